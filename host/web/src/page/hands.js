// Mouse, wheel, fingers and keys over the picture, as the viewer knows them.
//
// One finger turns and taps, two move and pinch: a tap goes down only when it is over, or
// when it has become a drag, for a second finger may follow.

/** A finger that moved less has tapped, CSS pixels. */
const TAP = 8;
/** Steps of the wheel that bring things e times nearer. */
const STEPS_PER_E = 12.5;
/** Pixels and lines that a step of a wheel scrolls by in browsers. */
const STEP = [100, 3, 1];
const [LEFT, RIGHT] = [1, 3];
/** Keys that stay the browser's. */
const BROWSER_KEYS = new Set(["Tab", "F11", "F12", "Dead", "Process", "Unidentified"]);

export class Hands {
  #canvas;
  #say;
  /** Where a mouse went since it was told. */
  #moved = null;
  #held = "{}";
  #keys = new Set();
  #fingers = new Map();
  /** What fingers do: null, "tap", "turn" or "pan". */
  #gesture = null;
  #spread = 0;

  constructor(canvas, say) {
    this.#canvas = canvas;
    this.#say = say;
    const on = (kind, act) => canvas.addEventListener(kind, act, { passive: false });
    on("pointerdown", (event) => this.#down(event));
    on("pointermove", (event) => this.#move(event));
    on("pointerup", (event) => this.#up(event));
    on("pointercancel", (event) => this.#up(event));
    on("pointerleave", () => this.#leave());
    on("contextmenu", (event) => event.preventDefault());
    on("wheel", (event) => this.#wheel(event));
    on("keydown", (event) => this.#key(event, true));
    on("keyup", (event) => this.#key(event, false));
    on("blur", () => this.letGo());
  }

  /** Lets go of keys. */
  letGo() {
    this.#keys.forEach((key) => this.#say({ key: { key, pressed: false } }));
    this.#keys.clear();
    this.#hold({ shift: false, ctrl: false, alt: false });
  }

  /** Where in the picture an event is: it may be narrower or lower than the page. */
  #place({ clientX, clientY }) {
    const box = this.#canvas.getBoundingClientRect();
    const { width, height } = this.#canvas;
    const scale = Math.min(box.width / width, box.height / height) || 1;
    const inPicture = (client, edge, side, pixels) =>
      (client - edge - (side - pixels * scale) / 2) / scale;
    return [
      inPicture(clientX, box.left, box.width, width),
      inPicture(clientY, box.top, box.height, height),
    ];
  }

  #button(at, button, pressed) {
    this.#flush();
    this.#say({ button: { at, button, pressed } });
  }

  /** Moves are told once a picture of the browser's. */
  #moveTo(at) {
    if (this.#moved === null) requestAnimationFrame(() => this.#flush());
    this.#moved = at;
  }

  #flush() {
    if (this.#moved !== null) this.#say({ moved: this.#moved });
    this.#moved = null;
  }

  #leave() {
    this.#flush();
    if (this.#fingers.size === 0) this.#say("left");
  }

  #down(event) {
    this.#canvas.focus({ preventScroll: true });
    this.#canvas.setPointerCapture(event.pointerId);
    this.#holdAsOf(event);
    if (event.pointerType === "touch") return this.#touch(event);
    const at = this.#place(event);
    this.#moveTo(at);
    this.#button(at, event.button + 1, true);
  }

  #move(event) {
    if (event.pointerType === "touch") return this.#drag(event);
    this.#holdAsOf(event);
    this.#moveTo(this.#place(event));
    // Further buttons of a mouse come as moves.
    if (event.button >= 0 && event.button < 3) {
      this.#button(this.#place(event), event.button + 1, (event.buttons & [1, 4, 2][event.button]) !== 0);
    }
  }

  #up(event) {
    if (event.pointerType === "touch") return this.#lift(event);
    this.#button(this.#place(event), event.button + 1, false);
  }

  #wheel(event) {
    event.preventDefault();
    this.#flush();
    this.#say({ scrolled: -event.deltaY / STEP[event.deltaMode] });
  }

  #touch(event) {
    this.#fingers.set(event.pointerId, { at: this.#place(event), x: event.clientX, y: event.clientY });
    if (this.#fingers.size === 1) {
      this.#gesture = "tap";
      this.#moveTo(this.#place(event));
    } else if (this.#fingers.size === 2) {
      if (this.#gesture === "turn") this.#button(this.#middle(), LEFT, false);
      this.#gesture = "pan";
      this.#spread = this.#distance();
      this.#moveTo(this.#middle());
      this.#button(this.#middle(), RIGHT, true);
    }
  }

  #drag(event) {
    const finger = this.#fingers.get(event.pointerId);
    if (!finger) return;
    const from = finger.at;
    finger.at = this.#place(event);
    if (this.#gesture === "tap") {
      if (Math.hypot(event.clientX - finger.x, event.clientY - finger.y) < TAP) return;
      this.#gesture = "turn";
      this.#button(from, LEFT, true);
    }
    if (this.#gesture === "turn") this.#moveTo(finger.at);
    if (this.#gesture === "pan" && this.#fingers.size >= 2) {
      this.#moveTo(this.#middle());
      const spread = this.#distance();
      const steps = Math.log(spread / this.#spread) * STEPS_PER_E;
      if (Math.abs(steps) > 0.1) {
        this.#spread = spread;
        this.#flush();
        this.#say({ scrolled: steps });
      }
    }
  }

  #lift(event) {
    const finger = this.#fingers.get(event.pointerId);
    if (!finger) return;
    const at = this.#fingers.size >= 2 ? this.#middle() : finger.at;
    this.#fingers.delete(event.pointerId);
    if (this.#gesture === "tap" && event.type === "pointerup") {
      this.#button(at, LEFT, true);
      this.#button(at, LEFT, false);
    }
    if (this.#gesture === "turn") this.#button(at, LEFT, false);
    if (this.#gesture === "pan") this.#button(at, RIGHT, false);
    // Fingers that stay do nothing until all are lifted.
    this.#gesture = null;
    if (this.#fingers.size === 0) this.#say("left");
  }

  /** Between the first two fingers. */
  #middle() {
    const [one, other] = [...this.#fingers.values()].map((finger) => finger.at);
    return [(one[0] + other[0]) / 2, (one[1] + other[1]) / 2];
  }

  #distance() {
    const [one, other] = [...this.#fingers.values()].map((finger) => finger.at);
    return Math.max(1, Math.hypot(one[0] - other[0], one[1] - other[1]));
  }

  #key(event, pressed) {
    const { key, ctrlKey, metaKey, repeat } = event;
    // With Ctrl, digits alone are the viewer's.
    if (BROWSER_KEYS.has(key) || metaKey || (ctrlKey && key.length === 1 && !/\d/.test(key))) return;
    event.preventDefault();
    const isText = pressed && key.length === 1 && (!ctrlKey && !event.altKey || event.getModifierState("AltGraph"));
    this.#flush();
    if (pressed) this.#keys.add(key);
    else this.#keys.delete(key);
    const modifiers = modifiersOf(event);
    this.#held = JSON.stringify(modifiers);
    this.#say({ key: { key, pressed, repeated: repeat, modifiers } });
    if (isText) this.#say({ text: key });
  }

  #holdAsOf(event) {
    this.#hold(modifiersOf(event));
  }

  #hold(modifiers) {
    const held = JSON.stringify(modifiers);
    if (held === this.#held) return;
    this.#held = held;
    this.#flush();
    this.#say({ holds: modifiers });
  }
}

function modifiersOf(event) {
  const isAltGraph = event.getModifierState?.("AltGraph") ?? false;
  return {
    shift: event.shiftKey,
    ctrl: event.ctrlKey && !isAltGraph,
    alt: event.altKey && !isAltGraph,
  };
}
