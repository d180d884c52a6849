// The board in space: axes drawn on it and in the world, LEDs that glow, height as a stalk above the floor.
// The scene's coordinates are the world's: x north, y west, z up. One looks from the east towards the west, so that at
// yaw 0 the board's X points to the right and its Y away, as on the drawing of the board.

import {
  AmbientLight, BoxGeometry, BufferGeometry, CanvasTexture, Color, ConeGeometry, CylinderGeometry, DirectionalLight,
  Group, Line, LineBasicMaterial, Matrix4, Mesh, MeshStandardMaterial, PerspectiveCamera, Plane, PointLight, Raycaster,
  Scene, Sphere, Sprite, SpriteMaterial, SRGBColorSpace, Vector2, Vector3, WebGLRenderer,
} from "three";
import { colour } from "./dom";
import type { Place } from "./protocol";
import type { Matrix } from "./rotation";

export interface BoardPicture {
  element: HTMLElement;
  show(rotation: Matrix, altitude: number, leds: Record<string, boolean>, magnet: Place | null): void;
  // Whether the magnet is at this place of the window, and where a magnet at this height would be there.
  onMagnet(event: MouseEvent): boolean;
  under(event: MouseEvent, up: number): Place | null;
  restyle(): void;
  resize(): void;
  readonly right: [number, number, number];
  readonly towards: [number, number, number];
}

const AXES: [string, string, [number, number, number]][] = [
  ["X", "--axis-x", [1, 0, 0]], ["Y", "--axis-y", [0, 1, 0]], ["Z", "--axis-z", [0, 0, 1]],
];
const METRES = 0.2; // of the way to the magnet that a unit of the scene is; the board itself is drawn larger
const LED_COLOURS: Record<string, number> = { LED1: 0xffb020, LED2: 0x38d67a };

function label(text: string, fill: string, size: number, above = false): Sprite {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const context = canvas.getContext("2d");
  if (context) {
    context.font = `600 ${text.length > 2 ? 30 : 84}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillStyle = fill;
    context.fillText(text, 64, 68);
  }
  const map = new CanvasTexture(canvas);
  map.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(new SpriteMaterial({ map, depthTest: !above, transparent: true }));
  sprite.scale.setScalar(size);
  return sprite;
}

function arrow(direction: Vector3, length: number, radius: number, fill: Color): Group {
  const material = new MeshStandardMaterial({ color: fill, roughness: 0.5, emissive: fill, emissiveIntensity: 0.25 });
  const shaft = new Mesh(new CylinderGeometry(radius, radius, length, 12), material);
  shaft.position.y = length / 2;
  const head = new Mesh(new ConeGeometry(radius * 3, radius * 9, 16), material);
  head.position.y = length + radius * 4;
  const group = new Group().add(shaft, head);
  group.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), direction);
  return group;
}

function box(x: number, y: number, z: number, at: [number, number, number], fill: number, roughness = 0.7): Mesh {
  const mesh = new Mesh(new BoxGeometry(x, y, z), new MeshStandardMaterial({ color: fill, roughness }));
  mesh.position.set(...at);
  return mesh;
}

export function boardIn3d(): BoardPicture | null {
  let renderer: WebGLRenderer;
  try {
    renderer = new WebGLRenderer({ antialias: true, alpha: true });
  } catch {
    return null;
  }
  const scene = new Scene();
  const camera = new PerspectiveCamera(32, 1, 0.1, 50);
  camera.up.set(0, 0, 1);
  camera.position.set(-1.05, -3.9, 2.35);
  camera.lookAt(0, 0, 0.05);
  scene.add(new AmbientLight(0xffffff, 1.5));
  const sun = new DirectionalLight(0xffffff, 2.2);
  sun.position.set(-2, -3, 6);
  scene.add(sun);

  const board = new Group();
  board.add(box(1.5, 1.3, 0.055, [0, 0, 0], 0x0d4f3f, 0.55));
  board.add(box(1.46, 1.26, 0.002, [0, 0, 0.029], 0x11604d, 0.6));
  for (const [x, y] of [[-0.66, -0.56], [0.66, -0.56], [-0.66, 0.56], [0.66, 0.56]] as const) {
    const ring = new Mesh(new CylinderGeometry(0.06, 0.06, 0.062, 24), new MeshStandardMaterial({ color: 0xc9a54a, metalness: 0.6, roughness: 0.35 }));
    const hole = new Mesh(new CylinderGeometry(0.036, 0.036, 0.066, 24), new MeshStandardMaterial({ color: 0x0a0d10 }));
    ring.rotation.x = hole.rotation.x = Math.PI / 2;
    ring.position.set(x, y, 0);
    hole.position.set(x, y, 0);
    board.add(ring, hole);
  }
  board.add(box(0.42, 0.42, 0.05, [-0.12, 0.08, 0.05], 0x16191d, 0.4)); // STM32F401
  board.add(box(0.15, 0.13, 0.045, [0.36, 0.2, 0.05], 0x2a2e33, 0.4)); // LSM6DSL
  board.add(box(0.11, 0.11, 0.045, [0.36, -0.02, 0.05], 0x2a2e33, 0.4)); // LIS2MDL
  board.add(box(0.12, 0.12, 0.05, [0.36, -0.22, 0.05], 0x8d939a, 0.3)); // LPS22HB
  board.add(box(0.3, 0.22, 0.1, [-0.1, -0.56, 0.075], 0xb9bec4, 0.3)); // USB
  board.add(box(0.28, 0.16, 0.06, [-0.5, 0.36, 0.055], 0x1d2226, 0.6));
  for (const x of [-0.62, -0.52, -0.42, -0.32]) board.add(box(0.05, 0.03, 0.03, [x, -0.12, 0.045], 0x9a8a5a, 0.5));
  const lights: Record<string, { lamp: MeshStandardMaterial; light: PointLight; tint: Color }> = {};
  Object.entries(LED_COLOURS).forEach(([name, hex], index) => {
    const tint = new Color(hex);
    const lamp = new MeshStandardMaterial({ color: 0x5a5f64, emissive: tint, emissiveIntensity: 0 });
    const mesh = new Mesh(new BoxGeometry(0.11, 0.07, 0.05), lamp);
    mesh.position.set(0.62, 0.3 - 0.24 * index - 0.06, 0.055);
    const light = new PointLight(tint, 0, 1.4, 1.6);
    light.position.set(0.62, mesh.position.y, 0.22);
    board.add(mesh, light);
    lights[name] = { lamp, light, tint };
  });
  scene.add(board);
  const magnet = new Group().add(box(0.14, 0.2, 0.1, [0, 0.1, 0], 0xc9302c, 0.45), box(0.14, 0.2, 0.1, [0, -0.1, 0], 0x2f5fc4, 0.45));
  magnet.visible = false;
  scene.add(magnet);

  let decoration = new Group();
  let marks = new Group();
  const stalk = new Line(new BufferGeometry(), new LineBasicMaterial());
  scene.add(stalk);
  const FLOOR = -0.62, EDGE = 1.05;

  const restyle = (): void => {
    scene.remove(decoration);
    board.remove(marks);
    decoration = new Group();
    marks = new Group();
    const faint = new Color(colour("--grid")), ink = colour("--muted");
    const grid: Vector3[] = [];
    for (let i = -3; i <= 3; i++) {
      const at = i * 0.35;
      grid.push(new Vector3(-EDGE, at, FLOOR), new Vector3(EDGE, at, FLOOR), new Vector3(at, -EDGE, FLOOR), new Vector3(at, EDGE, FLOOR));
    }
    for (let i = 0; i < grid.length; i += 2) {
      const pair = new BufferGeometry().setFromPoints([grid[i] as Vector3, grid[i + 1] as Vector3]);
      decoration.add(new Line(pair, new LineBasicMaterial({ color: faint })));
    }
    const winds: [string, number, number][] = [["N", 1.2, 0], ["W", 0, 1.2], ["S", -1.2, 0], ["E", 0, -1.2]];
    for (const [name, x, y] of winds) {
      const sprite = label(name, name === "N" ? colour("--accent") : ink, 0.22);
      sprite.position.set(x, y, FLOOR);
      decoration.add(sprite);
    }
    const corner = new Vector3(-EDGE, EDGE, FLOOR);
    for (const [name, variable, direction] of AXES) {
      const fill = new Color(colour(variable)), along = new Vector3(...direction);
      const inWorld = arrow(along, 0.34, 0.012, fill);
      inWorld.position.copy(corner);
      decoration.add(inWorld);
      const onBoard = arrow(along, name === "Z" ? 0.62 : 0.95, 0.018, fill);
      onBoard.position.set(0, 0, 0.05);
      const sign = label(name, colour(variable), 0.24, true);
      sign.position.copy(along.multiplyScalar(name === "Z" ? 0.92 : 1.24)).add(new Vector3(0, 0, 0.05));
      marks.add(onBoard, sign);
    }
    for (const [name, at] of [["world x", [0.55, 0, 0]], ["y", [0, 0.5, 0]], ["z", [0, 0, 0.52]]] as const) {
      const sign = label(name.at(-1) ?? "", ink, 0.15);
      sign.position.copy(corner).add(new Vector3(...at));
      decoration.add(sign);
    }
    (stalk.material as LineBasicMaterial).color = new Color(colour("--muted"));
    board.add(marks);
    scene.add(decoration);
    draw();
  };

  let waiting = false;
  const draw = (): void => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      renderer.render(scene, camera);
    });
  };
  const element = renderer.domElement;
  const sight = new Raycaster();
  const look = (event: MouseEvent): void => {
    const area = element.getBoundingClientRect();
    const x = (event.clientX - area.left) / area.width, y = (event.clientY - area.top) / area.height;
    sight.setFromCamera(new Vector2(2 * x - 1, 1 - 2 * y), camera);
  };
  let shown = "", raised = 0;
  restyle();
  return {
    element,
    right: [1, 0, 0],
    towards: [0, -1, 0],
    restyle,
    resize() {
      const { clientWidth: width, clientHeight: height } = element.parentElement ?? element;
      if (!width || !height) return;
      renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.fov = (2 * Math.atan(Math.max(0.31, 0.31 / camera.aspect)) * 180) / Math.PI;
      camera.updateProjectionMatrix();
      draw();
    },
    onMagnet(event) {
      look(event);
      return magnet.visible && sight.ray.intersectsSphere(new Sphere(magnet.position, 0.24));
    },
    under(event, up) {
      look(event);
      const level = raised + up / METRES;
      const at = sight.ray.intersectPlane(new Plane(new Vector3(0, 0, 1), -level), new Vector3());
      return at && [at.x * METRES, at.y * METRES, up];
    },
    show(rotation, altitude, leds, place) {
      const height = (raised = 0.9 * Math.tanh(altitude / 6));
      const key = `${rotation.join()} ${height.toFixed(4)} ${JSON.stringify(leds)} ${String(place)}`;
      if (key === shown) return;
      shown = key;
      const [a = 1, b = 0, c = 0, d = 0, e = 1, f = 0, g = 0, h = 0, i = 1] = rotation;
      board.matrixAutoUpdate = false;
      board.matrix = new Matrix4().set(a, b, c, 0, d, e, f, 0, g, h, i, height, 0, 0, 0, 1);
      board.matrixWorldNeedsUpdate = true;
      magnet.visible = place !== null;
      if (place) magnet.position.set(place[0] / METRES, place[1] / METRES, height + place[2] / METRES);
      stalk.geometry.setFromPoints([new Vector3(0, 0, FLOOR), new Vector3(0, 0, height)]);
      for (const [name, on] of Object.entries(leds)) {
        const led = lights[name];
        if (!led) continue;
        led.lamp.emissiveIntensity = on ? 3 : 0;
        led.lamp.color = on ? led.tint : new Color(0x5a5f64);
        led.light.intensity = on ? 1.6 : 0;
      }
      draw();
    },
  };
}
