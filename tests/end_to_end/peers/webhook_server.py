"""Web server (http.server) that takes webhooks: keeps what is posted, and answers as it is told.

Arguments: --port N, and JSON with "certificate" and "key" for https. Commands are lines of JSON:
{"messages": true} answers with all requests taken, {"status": 503} sets the answer.
"""

import argparse
import http.server
import json
import ssl
import sys
import threading


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        status = self.server.status
        if status < 300:
            self.server.messages.append({
                "path": self.path,
                "authorization": self.headers["Authorization"],
                "key": self.headers["Idempotency-Key"],
                "host": self.headers["Host"],
                "body": json.loads(body),
            })
        self.send_response(status)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_):
        pass


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("spec", nargs="?", default="{}")
    arguments = parser.parse_args()
    spec = json.loads(arguments.spec)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", arguments.port), Handler)
    server.status, server.messages = 204, []
    if "certificate" in spec:
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        context.load_cert_chain(spec["certificate"], spec["key"])
        server.socket = context.wrap_socket(server.socket, server_side=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    print(f"READY {server.server_address[1]}", flush=True)
    for line in sys.stdin:
        command = json.loads(line)
        if "messages" in command:
            print(json.dumps(server.messages), flush=True)
            continue
        server.status = command["status"]
        print("OK", flush=True)


main()
