// Rotations as nine numbers by rows, board to world (x north, y west, z up), and Euler angles in degrees with
// R = Rz(yaw) Ry(pitch) Rx(roll): the conventions of emulator/world/attitude.py.

export type Matrix = number[];
export interface Angles { roll: number; pitch: number; yaw: number }

const RAD = Math.PI / 180;

export function multiply(a: Matrix, b: Matrix): Matrix {
  const product: Matrix = [];
  for (let row = 0; row < 3; row++) {
    for (let column = 0; column < 3; column++) {
      let sum = 0;
      for (let k = 0; k < 3; k++) sum += (a[3 * row + k] ?? 0) * (b[3 * k + column] ?? 0);
      product.push(sum);
    }
  }
  return product;
}

export function about(axis: [number, number, number], degrees: number): Matrix {
  const length = Math.hypot(...axis) || 1;
  const [x, y, z] = axis.map((one) => one / length) as [number, number, number];
  const s = Math.sin(degrees * RAD), c = Math.cos(degrees * RAD), v = 1 - c;
  return [c + v * x * x, v * x * y - s * z, v * x * z + s * y, v * x * y + s * z, c + v * y * y, v * y * z - s * x,
    v * x * z - s * y, v * y * z + s * x, c + v * z * z];
}

export function toMatrix({ roll, pitch, yaw }: Angles): Matrix {
  return multiply(multiply(about([0, 0, 1], yaw), about([0, 1, 0], pitch)), about([1, 0, 0], roll));
}

export function toAngles(m: Matrix): Angles {
  const at = (index: number): number => m[index] ?? 0;
  const cosine = Math.hypot(at(7), at(8));
  const pitch = Math.atan2(-at(6), cosine) / RAD;
  if (cosine < 1e-9) return { roll: 0, pitch, yaw: Math.atan2(-at(1), at(4)) / RAD };
  return { roll: Math.atan2(at(7), at(8)) / RAD, pitch, yaw: Math.atan2(at(3), at(0)) / RAD };
}
