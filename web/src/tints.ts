// Colours of the plot's series: no two series of one plot have the same. Axes keep their hue (x red, y green, z blue);
// the truth is paler than what is printed, and what is read has a hue beside it.

export type Kind = "truth" | "raw" | "print" | "var";
export interface Tinted { kind: Kind; family: "x" | "y" | "z" | "" }

const HUES = { x: 27, y: 145, z: 262, "": 215 };
const BESIDE = 35; // degrees of hue, from one sensor's readings to those of the next
const GOLDEN = 137.5; // degrees: any number of variables, each far from those before

export function tints(series: Tinted[], dark: boolean): string[] {
  const used = new Set<string>();
  const counts = new Map<string, number>();
  return series.map(({ kind, family }) => {
    const key = `${kind} ${family}`, index = counts.get(key) ?? 0;
    counts.set(key, index + 1);
    const firm = dark ? 0.78 : 0.52, pale = dark ? 0.6 : 0.64;
    let hue = HUES[family];
    if (kind === "raw") hue += BESIDE * (index + 1);
    if (kind === "var") hue += GOLDEN * index;
    const lightness = kind === "truth" ? pale : kind === "var" && index % 2 ? firm + 0.1 : firm;
    const chroma = kind === "truth" ? (family ? 0.11 : 0.02) : 0.15;
    const written = (): string => `oklch(${lightness.toFixed(2)} ${chroma} ${(hue % 360).toFixed(1)})`;
    while (used.has(written())) hue += 11;
    used.add(written());
    return written();
  });
}
