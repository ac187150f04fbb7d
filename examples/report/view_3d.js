// The 3-D view of a report: points of the scans, which can be turned, zoomed, hidden and coloured. The data are
// those of examples/support/report/view_3d.hpp. Draws only when something has changed.
import {
  BufferAttribute, BufferGeometry, Color, InterleavedBuffer, InterleavedBufferAttribute, Matrix4, PerspectiveCamera,
  Points, PointsMaterial, Scene, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const up = new Vector3(0, 0, 1);

/** Integers of 16 bit: x, y, z and height of each point. */
function integersOf(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Uint16Array.from({ length: bytes.length / 2 }, (_, i) => view.getUint16(2 * i, true));
}

/** From dark blue over green to yellow, for 0 to 1; lightness grows, so that it is read with any colour vision. */
function colourOfShare(share) {
  const stops = [[68, 50, 126], [49, 104, 142], [31, 158, 137], [109, 205, 89], [253, 231, 37]];
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const k = Math.min(Math.floor(at), stops.length - 2);
  return stops[k].map((low, channel) => low + (at - k) * (stops[k + 1][channel] - low));
}

function pointsOf(scan) {
  const integers = integersOf(scan.points);
  const buffer = new InterleavedBuffer(integers, 4);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new InterleavedBufferAttribute(buffer, 3, 0));
  const colours = new Uint8Array(3 * scan.count);
  for (let i = 0; i < scan.count; ++i) colours.set(colourOfShare(integers[4 * i + 3] / 300), 3 * i);
  geometry.setAttribute("color", new BufferAttribute(colours, 3, true));
  const points = new Points(geometry, new PointsMaterial({ size: 2, sizeAttenuation: false }));
  points.matrixAutoUpdate = false;
  points.frustumCulled = false;
  points.userData = new Matrix4()
    .makeTranslation(...scan.low)
    .multiply(new Matrix4().makeScale(...scan.step)); // scan from integers
  return points;
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** A checkbox or a radio button with its label. */
function choice(type, name, label, isChecked, change, ...before) {
  const input = element("input", { type, name, value: label });
  input.checked = isChecked;
  input.addEventListener("change", () => change(input.checked));
  return element("label", {}, input, ...before, " " + label);
}

class View {
  constructor(place, data) {
    this.data = data;
    this.scene = new Scene();
    this.scans = data.scans.map(pointsOf);
    this.scans.forEach((points) => this.scene.add(points));
    this.swatches = data.scans.map(() => element("span", { class: "swatch" }));
    this.canvas = element("canvas", {
      tabindex: "0", role: "application",
      "aria-label": "Points of the understory in space. Arrow keys turn the view, plus and minus zoom.",
    });
    this.renderer = new WebGLRenderer({ canvas: this.canvas, preserveDrawingBuffer: true });
    this.camera = new PerspectiveCamera(45, 1, 0.1, 5000);
    this.camera.up.copy(up);
    this.place(0);
    place.replaceChildren(this.tools(), this.canvas);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.canvas.addEventListener("keydown", (event) => this.turnByKey(event));
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.dark.addEventListener("change", () => this.paint());
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    this.look(0.9);
    this.paint();
    this.resize();
    // Another transform of the report is chosen among its pictures.
    document.querySelectorAll('input[name="shown"]').forEach((input) =>
      input.addEventListener("change", () => { this.place(Number(input.value)); this.draw(); }));
  }

  /** Moves the scans to where a placement has them. */
  place(number) {
    const placement = this.data.placements[number];
    this.scans.forEach((points, i) => {
      points.matrix.copy(new Matrix4().set(...placement.matrices[i]).multiply(points.userData));
      points.matrixWorldNeedsUpdate = true;
    });
    this.label = placement.label;
  }

  /** Where most of the points are. */
  extent() {
    const places = [];
    for (const points of this.scans) {
      const position = points.geometry.getAttribute("position");
      for (let i = 0; i < position.count; i += 50)
        places.push(new Vector3().fromBufferAttribute(position, i).applyMatrix4(points.matrix));
    }
    const center = new Vector3();
    for (const place of places) center.addScaledVector(place, 1 / places.length);
    const distances = places.map((place) => place.distanceTo(center)).sort((a, b) => a - b);
    return { center, radius: distances[Math.floor(0.9 * distances.length)] || 1 };
  }

  /** Most in sight, from the side that the angle above the ground [rad] says. */
  look(angle) {
    const { center, radius } = this.extent();
    const distance = Math.max((1.2 * radius) / Math.tan((this.camera.fov * Math.PI) / 360), 1);
    this.controls.target.copy(center);
    this.camera.position.copy(center)
      .add(new Vector3(0, -Math.cos(angle), Math.sin(angle)).multiplyScalar(distance));
    this.camera.near = distance / 1000;
    this.camera.far = 20 * distance + 10;
    this.camera.updateProjectionMatrix();
    this.controls.update();
  }

  turnByKey(event) {
    const step = Math.PI / 36;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const aside = new Vector3().crossVectors(up, offset).normalize();
    const actions = {
      ArrowLeft: () => offset.applyAxisAngle(up, -step), ArrowRight: () => offset.applyAxisAngle(up, step),
      ArrowUp: () => offset.applyAxisAngle(aside, -step), ArrowDown: () => offset.applyAxisAngle(aside, step),
      "+": () => offset.multiplyScalar(0.9), "-": () => offset.multiplyScalar(1 / 0.9),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    const before = offset.clone();
    actions[event.key]();
    if (offset.angleTo(up) < 0.02 || offset.angleTo(up) > Math.PI - 0.02) offset.copy(before);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
  }

  tools() {
    const scans = element("fieldset", {}, element("legend", {}, "Scans"));
    const list = scans.appendChild(element("div", this.scans.length > 12
      ? { class: "many", tabindex: "0", role: "group", "aria-label": "Scans" } : {}));
    this.data.scans.forEach((scan, i) => {
      const show = (isShown) => { this.scans[i].visible = isShown; this.draw(); };
      list.append(choice("checkbox", "scan", scan.name, true, show, this.swatches[i]), " ");
    });
    const colour = element("fieldset", {}, element("legend", {}, "Colour by"),
      choice("radio", "colour", "scan", true, () => this.paint(false)),
      choice("radio", "colour", "height above ground", false, () => this.paint(true)));
    const buttons = [["From above", Math.PI / 2 - 0.01], ["From the side", 0.02], ["Oblique", 0.9]]
      .map(([label, angle]) => {
        const button = element("button", { type: "button" }, label);
        button.addEventListener("click", () => this.look(angle));
        return button;
      });
    return element("div", { class: "tools" }, scans, colour, element("div", {}, ...buttons));
  }

  /** Colours of points, of the dots beside their names, and of the background. */
  paint(byHeight = this.byHeight) {
    this.byHeight = byHeight;
    this.renderer.setClearColor(this.dark.matches ? 0x0c0f12 : 0xffffff);
    this.scans.forEach((points, i) => {
      const own = new Color(this.data.scans[i].colour);
      if (this.dark.matches) own.lerp(new Color(0xffffff), 0.1);
      this.swatches[i].style.background = own.getStyle();
      points.material.color.copy(byHeight ? new Color(0xffffff) : own);
      points.material.vertexColors = Boolean(byHeight);
      points.material.needsUpdate = true;
    });
    this.draw();
  }

  resize() {
    const ratio = Math.min(devicePixelRatio, 2);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.scans.forEach((points) => { points.material.size = 2 * ratio; });
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    if (this.isWaiting) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      this.renderer.render(this.scene, this.camera);
      this.canvas.dataset.drawn = String(Number(this.canvas.dataset.drawn || 0) + 1);
      if (this.canvas.dataset.drawn === "1") performance.mark("view_3d");
    });
  }
}

function start() {
  const place = document.getElementById("view_3d");
  const said = place.innerHTML;
  try {
    new View(place, JSON.parse(document.getElementById("view_data").textContent));
  } catch (error) {
    place.innerHTML = said;
    place.append(element("p", {}, String(error.message)));
  }
}

// The page is shown first.
requestAnimationFrame(() => setTimeout(start));
