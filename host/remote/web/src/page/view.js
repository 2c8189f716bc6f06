// The page: its picture, what arrives from the server, and what goes to the page around it.

import { Liveness, PROBE_PERIOD } from "./liveness.js";
import { InputState } from "./input.js";
import { ServerConnection } from "./connection.js";
import { Picture } from "./picture.js";
import { HostPage } from "./host_page.js";

/** Time for which a refusal is shown, milliseconds. */
const REFUSED_SHOWN = 6000;

const element = (id) => document.getElementById(id);
const canvas = element("picture");
const picture = new Picture(canvas);
const hostPage = new HostPage(document.documentElement.dataset.origins, handleRequest);

let views = 0;
let steers = false;
/** Alarm counts by state, while they are known. */
let alarms = null;
let refusedTimer = 0;

// Until the server has heard of the page's size, what it says of the picture does not count.
const seesPicture = (known) => known === views && picture.hasPicture && !document.hidden;
const liveness = new Liveness(seesPicture, postLiveness);
const connection = new ServerConnection({ opened, closed, handleMessage, handlePicture });
const input = new InputState(canvas, (message) => steers && connection.send(message));

function opened() {
  liveness.explain("");
  views = 0;
  sendView();
  probe();
}

function closed(words) {
  alarms = null;
  setSteering(false, false);
  liveness.disconnected(words);
}

async function handlePicture(bytes, reply) {
  const number = await picture.show(bytes);
  reply({ shown: number });
  liveness.update();
}

function handleMessage(message) {
  if (message.beat) {
    liveness.takeBeat(message.beat);
  } else if (message.steers !== undefined) {
    setSteering(message.steers, true);
  } else if (message.lost !== undefined) {
    liveness.explain(message.lost);
  } else if (message.picked !== undefined) {
    hostPage.post({ busbar: "picked", equipment: message.picked });
  } else if (message.alarms) {
    alarms = message.alarms;
    if (liveness.isLive) postAlarms();
  } else if (message.refused !== undefined) {
    refuse(message.refused);
  }
}

/** Sends the size of the page, and its visibility. */
function sendView() {
  const size = [Math.round(canvas.clientWidth), Math.round(canvas.clientHeight)];
  views += connection.send({ view: { size, visible: !document.hidden } }) ? 1 : 0;
}

/** Sends a probe, whose echo proves the age of the picture. */
function probe() {
  if (!document.hidden && connection.isOpen) connection.send({ probe: liveness.probe() });
}

function postLiveness(condition) {
  if (!liveness.isLive) {
    hostPage.post({ busbar: "lost", reason: condition });
  } else {
    hostPage.post({ busbar: liveness.wasEverLive ? "recovered" : "ready" });
    postAlarms();
  }
}

function postAlarms() {
  if (alarms !== null) hostPage.post({ busbar: "alarms", ...alarms });
}

function setSteering(now, isKnown) {
  steers = now;
  if (!steers) input.releaseKeys();
  element("steering").hidden = steers || !isKnown;
}

function refuse(words) {
  const place = element("refused");
  place.textContent = words;
  place.hidden = false;
  clearTimeout(refusedTimer);
  refusedTimer = setTimeout(() => { place.hidden = true; }, REFUSED_SHOWN);
  hostPage.post({ busbar: "refused", reason: words });
}

/** Executes a request of the host page. */
function handleRequest(message) {
  switch (message.busbar) {
    case "focus": return connection.send({ focus: String(message.equipment) });
    case "camera": return connection.send({ camera: String(message.name) });
    case "theta": return connection.send({ theta: message.value === null ? null : Number(message.value) });
    case "hello": return postState();
    default: return refuse(`'${message.busbar}' is nothing that this page does`);
  }
}

/** Posts the present state to a host page that was loaded later. */
function postState() {
  const condition = liveness.condition();
  const reason = condition === "live" ? "late" : condition;
  hostPage.post(liveness.isLive ? { busbar: "ready" } : { busbar: "lost", reason });
  if (liveness.isLive) postAlarms();
}

element("steer").addEventListener("click", () => {
  connection.send("steer");
  canvas.focus();
});
document.addEventListener("visibilitychange", () => {
  sendView();
  probe();
  liveness.update();
});
let resizeTimer = 0;
new ResizeObserver(() => {
  clearTimeout(resizeTimer);
  resizeTimer = setTimeout(sendView, 150);
}).observe(canvas);
setInterval(probe, PROBE_PERIOD);
connection.open();
