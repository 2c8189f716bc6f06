// Pointer, wheel, touch and keyboard input over the picture, as messages for the viewer.
//
// One touch turns and taps, two pan and pinch. The button of a tap goes down only when the tap is
// over, or when it has become a drag, for a second touch may follow.

/** Movement below which a touch is a tap, CSS pixels. */
const TAP = 8;
/** Steps of the wheel that magnify by e. */
const STEPS_PER_E = 12.5;
/** Pixels and lines that a step of a wheel scrolls by in browsers. */
const STEP = [100, 3, 1];
const [LEFT, RIGHT] = [1, 3];
/** Keys that are left to the browser. */
const BROWSER_KEYS = new Set(["Tab", "F11", "F12", "Dead", "Process", "Unidentified"]);

export class InputState {
  #canvas;
  #send;
  /** Position of the pointer that is not sent yet. */
  #pendingMove = null;
  #modifiers = "{}";
  #pressedKeys = new Set();
  #touches = new Map();
  /** Gesture of the touches: null, "tap", "turn" or "pan". */
  #gesture = null;
  #spread = 0;

  constructor(canvas, send) {
    this.#canvas = canvas;
    this.#send = send;
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
    on("blur", () => this.releaseKeys());
  }

  /** Sends the release of all keys and modifiers. */
  releaseKeys() {
    this.#pressedKeys.forEach((key) => this.#send({ key: { key, pressed: false } }));
    this.#pressedKeys.clear();
    this.#setModifiers({ shift: false, ctrl: false, alt: false });
  }

  /** Position of an event in the picture, pixels: the picture may be narrower or lower than the page. */
  #positionOf({ clientX, clientY }) {
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
    this.#send({ button: { at, button, pressed } });
  }

  /** Queues a move; one is sent for each frame of the browser. */
  #queueMove(at) {
    if (this.#pendingMove === null) requestAnimationFrame(() => this.#flush());
    this.#pendingMove = at;
  }

  #flush() {
    if (this.#pendingMove !== null) this.#send({ moved: this.#pendingMove });
    this.#pendingMove = null;
  }

  #leave() {
    this.#flush();
    if (this.#touches.size === 0) this.#send("left");
  }

  #down(event) {
    this.#canvas.focus({ preventScroll: true });
    this.#canvas.setPointerCapture(event.pointerId);
    this.#updateModifiers(event);
    if (event.pointerType === "touch") return this.#startTouch(event);
    const at = this.#positionOf(event);
    this.#queueMove(at);
    this.#button(at, event.button + 1, true);
  }

  #move(event) {
    if (event.pointerType === "touch") return this.#moveTouch(event);
    this.#updateModifiers(event);
    this.#queueMove(this.#positionOf(event));
    // Further buttons of a mouse come as moves.
    if (event.button >= 0 && event.button < 3) {
      this.#button(this.#positionOf(event), event.button + 1, (event.buttons & [1, 4, 2][event.button]) !== 0);
    }
  }

  #up(event) {
    if (event.pointerType === "touch") return this.#endTouch(event);
    this.#button(this.#positionOf(event), event.button + 1, false);
  }

  #wheel(event) {
    event.preventDefault();
    this.#flush();
    this.#send({ scrolled: -event.deltaY / STEP[event.deltaMode] });
  }

  #startTouch(event) {
    this.#touches.set(event.pointerId, { at: this.#positionOf(event), x: event.clientX, y: event.clientY });
    if (this.#touches.size === 1) {
      this.#gesture = "tap";
      this.#queueMove(this.#positionOf(event));
    } else if (this.#touches.size === 2) {
      if (this.#gesture === "turn") this.#button(this.#midpoint(), LEFT, false);
      this.#gesture = "pan";
      this.#spread = this.#distance();
      this.#queueMove(this.#midpoint());
      this.#button(this.#midpoint(), RIGHT, true);
    }
  }

  #moveTouch(event) {
    const touch = this.#touches.get(event.pointerId);
    if (!touch) return;
    const from = touch.at;
    touch.at = this.#positionOf(event);
    if (this.#gesture === "tap") {
      if (Math.hypot(event.clientX - touch.x, event.clientY - touch.y) < TAP) return;
      this.#gesture = "turn";
      this.#button(from, LEFT, true);
    }
    if (this.#gesture === "turn") this.#queueMove(touch.at);
    if (this.#gesture === "pan" && this.#touches.size >= 2) {
      this.#queueMove(this.#midpoint());
      const spread = this.#distance();
      const steps = Math.log(spread / this.#spread) * STEPS_PER_E;
      if (Math.abs(steps) > 0.1) {
        this.#spread = spread;
        this.#flush();
        this.#send({ scrolled: steps });
      }
    }
  }

  #endTouch(event) {
    const touch = this.#touches.get(event.pointerId);
    if (!touch) return;
    const at = this.#touches.size >= 2 ? this.#midpoint() : touch.at;
    this.#touches.delete(event.pointerId);
    if (this.#gesture === "tap" && event.type === "pointerup") {
      this.#button(at, LEFT, true);
      this.#button(at, LEFT, false);
    }
    if (this.#gesture === "turn") this.#button(at, LEFT, false);
    if (this.#gesture === "pan") this.#button(at, RIGHT, false);
    // Remaining touches do nothing until all are lifted.
    this.#gesture = null;
    if (this.#touches.size === 0) this.#send("left");
  }

  /** Midpoint of the first two touches. */
  #midpoint() {
    const [one, other] = [...this.#touches.values()].map((touch) => touch.at);
    return [(one[0] + other[0]) / 2, (one[1] + other[1]) / 2];
  }

  #distance() {
    const [one, other] = [...this.#touches.values()].map((touch) => touch.at);
    return Math.max(1, Math.hypot(one[0] - other[0], one[1] - other[1]));
  }

  #key(event, pressed) {
    const { key, ctrlKey, metaKey, repeat } = event;
    // With Ctrl, digits alone are the viewer's.
    if (BROWSER_KEYS.has(key) || metaKey || (ctrlKey && key.length === 1 && !/\d/.test(key))) return;
    event.preventDefault();
    const isText = pressed && key.length === 1 && (!ctrlKey && !event.altKey || event.getModifierState("AltGraph"));
    this.#flush();
    if (pressed) this.#pressedKeys.add(key);
    else this.#pressedKeys.delete(key);
    const modifiers = modifiersOf(event);
    this.#modifiers = JSON.stringify(modifiers);
    this.#send({ key: { key, pressed, repeated: repeat, modifiers } });
    if (isText) this.#send({ text: key });
  }

  #updateModifiers(event) {
    this.#setModifiers(modifiersOf(event));
  }

  #setModifiers(modifiers) {
    const text = JSON.stringify(modifiers);
    if (text === this.#modifiers) return;
    this.#modifiers = text;
    this.#flush();
    this.#send({ holds: modifiers });
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
