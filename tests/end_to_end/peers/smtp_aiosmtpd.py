"""Mail server (aiosmtpd): keeps what it takes, and refuses what it is told to.

Arguments: --port N, and JSON with "security" ("none", "starttls", "tls"), "certificate", "key",
"user" and "password". Commands are lines of JSON: {"messages": true} answers with all messages, a
number instead of true comes back with them,
{"refuse": [...]} refuses these recipients for good, {"busy": true} all for now.
"""

import argparse
import email
import email.policy
import json
import ssl
import sys

from aiosmtpd.controller import Controller
from aiosmtpd.smtp import SMTP, AuthResult


class Handler:
    def __init__(self):
        self.messages = []
        self.refused = set()
        self.is_busy = False

    async def handle_RCPT(self, server, session, envelope, address, options):
        if self.is_busy:
            return "451 4.3.0 try again later"
        if address in self.refused:
            return "550 5.1.1 there is no such user"
        envelope.rcpt_tos.append(address)
        return "250 OK"

    async def handle_DATA(self, server, session, envelope):
        parsed = email.message_from_bytes(envelope.content, policy=email.policy.default)
        self.messages.append({
            "to": envelope.rcpt_tos,
            "from": envelope.mail_from,
            "subject": parsed["Subject"],
            "id": parsed["Message-ID"],
            "automatic": parsed["Auto-Submitted"],
            "kind": parsed["X-Busbar-Kind"],
            "text": parsed.get_body().get_content(),
            "encrypted": server.transport.get_extra_info("ssl_object") is not None,
            "user": session.auth_data.login.decode() if session.auth_data else None,
        })
        return "250 taken"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("spec", nargs="?", default="{}")
    arguments = parser.parse_args()
    spec = json.loads(arguments.spec)
    security = spec.get("security", "none")
    handler = Handler()
    context = None
    if security != "none":
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        context.load_cert_chain(spec["certificate"], spec["key"])

    def authenticate(server, session, envelope, mechanism, data):
        is_right = (data.login.decode(), data.password.decode()) == (spec["user"], spec["password"])
        return AuthResult(success=is_right, handled=False, auth_data=data if is_right else None)

    login = {}
    if "user" in spec:
        login = {"authenticator": authenticate, "auth_required": True,
                 "auth_require_tls": security == "starttls"}

    class Server(Controller):
        def factory(self):
            starttls = {"tls_context": context, "require_starttls": True}
            return SMTP(self.handler, hostname="mail.test",
                        **(starttls if security == "starttls" else {}), **login)

    wrapped = {"ssl_context": context} if security == "tls" else {}
    port = arguments.port
    if port == 0:
        import socket
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
    server = Server(handler, hostname="127.0.0.1", port=port, ready_timeout=30, **wrapped)
    server.start()
    print(f"READY {port}", flush=True)
    for line in sys.stdin:
        command = json.loads(line)
        if "messages" in command:
            query, answer = command["messages"], handler.messages
            if query is not True:
                answer = {"query": query, "messages": answer}
            print(json.dumps(answer), flush=True)
            continue
        handler.refused = set(command.get("refuse", handler.refused))
        handler.is_busy = command.get("busy", handler.is_busy)
        print("OK", flush=True)
    server.stop()


main()
