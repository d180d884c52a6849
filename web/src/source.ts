// Places such as "main.c:48" in texts, as links that open the line in Visual Studio Code. Only files beside the loaded
// firmware file are linked.

let sources: Record<string, string> = {};

export function setSources(paths: Record<string, string>): void {
  sources = paths;
}

export function linked(text: string): (string | HTMLElement)[] {
  const parts: (string | HTMLElement)[] = [];
  let end = 0;
  for (const match of text.matchAll(/([\w.-]+\.\w+):(\d+)/g)) {
    const path = sources[match[1] ?? ""];
    if (!path) continue;
    const link = document.createElement("a");
    link.href = `vscode://file/${encodeURI(path).replace(/^\//, "")}:${match[2] ?? ""}`;
    link.title = "Open in Visual Studio Code";
    link.textContent = match[0];
    parts.push(text.slice(end, match.index), link);
    end = match.index + match[0].length;
  }
  return [...parts, text.slice(end)];
}
