"""Chromium with one page, told what to do line by line.

Reads a JSON object a line, such as {"open": ADDRESS}, does it, and answers one JSON line.
Pages of a folder are served from an origin of their own, which {"origin": FOLDER} names.
"""

import functools
import http.server
import json
import os
import sys
import threading

from playwright.sync_api import Error, sync_playwright

SIZE = {"width": 1000, "height": 640}
VIEW_STATE = """() => ({
    dead: document.getElementById("view").classList.contains("dead"),
    what: document.getElementById("what").textContent,
    age: document.getElementById("age").textContent,
    why: document.getElementById("why").textContent,
    shown: getComputedStyle(document.getElementById("state")).display !== "none",
    looksOnly: !document.getElementById("steering").hidden,
    filter: getComputedStyle(document.getElementById("picture")).filter,
    stripes: getComputedStyle(document.getElementById("hatch")).backgroundImage !== "none",
    address: location.href,
})"""
# Of the picture itself, without what lies over it: a checksum, and how many colours it has.
PICTURE = """() => {
    const canvas = document.getElementById("picture");
    const { width, height } = canvas;
    const pixels = new Uint32Array(
        canvas.getContext("2d").getImageData(0, 0, width, height).data.buffer);
    let sum = 0;
    for (const pixel of pixels) sum = (Math.imul(sum, 31) + pixel) | 0;
    return { width, height, sum, colors: new Set(pixels).size };
}"""

# Keeps a record of when the page counts as live: wall time in milliseconds, and whether.
WATCH = """() => {
    const view = document.getElementById("view");
    const note = () => window.liveLog.push([Date.now(), !view.classList.contains("dead")]);
    window.liveLog = [];
    window.liveWatch?.disconnect();
    window.liveWatch = new MutationObserver(note);
    window.liveWatch.observe(view, { attributes: true });
    note();
}"""

# Keeps a record of the clock's place in the picture, the lower left corner: wall time in
# milliseconds, whether the page counts as live, and the pixels, whenever one of these is another.
CLOCK_WATCH = """([width, height]) => {
    const view = document.getElementById("view");
    const canvas = document.getElementById("picture");
    const context = canvas.getContext("2d");
    let last = "";
    const note = () => {
        const { data } = context.getImageData(0, canvas.height - height, width, height);
        const pixels = [];
        for (let at = 1; at < data.length; at += 4) pixels.push(data[at]);
        const isLive = !view.classList.contains("dead");
        const now = `${isLive} ${pixels}`;
        if (now !== last) window.clockLog.push([Date.now(), isLive, pixels]);
        last = now;
    };
    window.clockLog = [];
    window.clockObserver?.disconnect();
    window.clockObserver = new MutationObserver(note);
    window.clockObserver.observe(view, { attributes: true });
    clearInterval(window.clockTimer);
    window.clockTimer = setInterval(note, 20);
    note();
}"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(folder):
    handler = functools.partial(Quiet, directory=folder)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://localhost:{server.server_port}"


class Browser:
    def __init__(self, chromium):
        self.context = chromium.new_context(viewport=SIZE, has_touch=True)
        self.page = self.context.new_page()
        self.bytes = 0
        self.faults = []
        self.page.on("websocket", self.count)
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("console", self.note)

    def note(self, message):
        # That a server is away is what some tests are about.
        if message.type == "error" and "ERR_CONNECTION" not in message.text:
            self.faults.append(message.text)

    def count(self, socket):
        def add(payload):
            self.bytes += len(payload)

        socket.on("framereceived", add)

    def view(self):
        """The frame with the view: the page itself, or the one in it."""
        return self.page.frames[-1]

    def open(self, address):
        response = self.page.goto(address)
        return {"status": response.status, "text": response.text()[:300]}

    def origin(self, folder):
        return serve(folder)

    def state(self, _):
        return self.view().evaluate(VIEW_STATE)

    def picture(self, _):
        return self.view().evaluate(PICTURE)

    def watch(self, _):
        self.view().evaluate(WATCH)

    def watched(self, _):
        return self.view().evaluate("() => window.liveLog")

    def watch_clock(self, size):
        self.view().evaluate(CLOCK_WATCH, size)

    def clock_looks(self, path):
        """Writes the record to a file, with the present wall time before it."""
        looks = self.view().evaluate("() => [Date.now(), window.clockLog.splice(0)]")
        with open(path, "w") as file:
            json.dump(looks, file)

    def texts(self, ids):
        """Of elements of the page around the view."""
        return {name: self.page.locator(f"#{name}").text_content() for name in ids}

    def fill(self, pair):
        self.page.locator(f"#{pair[0]}").fill(pair[1])

    def click(self, name):
        frame = self.page.frames[0]
        frame = frame if frame.locator(f"#{name}").count() else self.view()
        frame.locator(f"#{name}").click()

    def mouse(self, steps):
        mouse = self.page.mouse
        for what, *values in steps:
            if what == "move":
                mouse.move(*values)
            elif what == "down":
                mouse.down()
            elif what == "up":
                mouse.up()
            elif what == "wheel":
                mouse.wheel(0, values[0])
            self.page.wait_for_timeout(60)

    def touch(self, steps):
        """Each step has all fingers: [[id, x, y], ...]; none lifts all."""
        session = self.context.new_cdp_session(self.page)
        before = 0
        for fingers in steps:
            kind = "touchStart" if len(fingers) > before else "touchMove"
            kind = "touchEnd" if len(fingers) < before else kind
            points = [{"id": n, "x": x, "y": y} for n, x, y in fingers]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
            before = len(fingers)
            self.page.wait_for_timeout(60)
        session.detach()

    def key(self, name):
        self.page.keyboard.press(name)

    def wait(self, millis):
        self.page.wait_for_timeout(millis)

    def shot(self, path):
        self.page.screenshot(path=path)

    def received(self, _):
        self.page.wait_for_timeout(10)
        return self.bytes

    def errors(self, _):
        return self.faults


def main():
    program = os.environ.get("BUSBAR_CHROMIUM", "/usr/bin/chromium")
    with sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu"]
        chromium = playwright.chromium.launch(executable_path=program, args=arguments)
        browser = Browser(chromium)
        print("READY", flush=True)
        for line in sys.stdin:
            ((what, value),) = json.loads(line).items()
            try:
                answer = {"done": getattr(browser, what)(value)}
            except Error as error:
                answer = {"fault": str(error)}
            print(json.dumps(answer), flush=True)
        chromium.close()


main()
