"""An OPC UA server by asyncua, for the tests.

The specification is the first argument; what is said afterwards comes by lines of JSON
and is answered by OK. Certificates are made by `--make FOLDER NAME URI [NAME URI ...]`.
"""

import argparse
import asyncio
import datetime
import json
import logging
import pathlib
import sys

from asyncua import Server, ua
from asyncua.crypto.permission_rules import SimpleRoleRuleset, User, UserRole
from asyncua.server.user_managers import UserManager

import opcua_space

NAMESPACE = "urn:busbar:test"
APPLICATION = "urn:busbar:test:server"

POLICIES = {
    f"{name}/{mode}": getattr(ua.SecurityPolicyType, f"{name}_{mode}")
    for name in ("Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss")
    for mode in ("Sign", "SignAndEncrypt")
} | {"None": ua.SecurityPolicyType.NoSecurity}


class Users(UserManager):
    """Accepts the users of the specification alone; anybody where it has none."""

    def __init__(self, passwords, certificates):
        self.passwords = passwords
        self.certificates = [pathlib.Path(path).read_bytes() for path in certificates]

    def get_user(self, iserver, username=None, password=None, certificate=None):
        anybody = not self.passwords and not self.certificates
        by_name = username and self.passwords.get(username) == password
        if anybody or by_name or certificate in self.certificates:
            return User(role=UserRole.User, name=username)
        return None


def instant(millis):
    if millis is None:
        return None
    return datetime.datetime.fromtimestamp(millis / 1000, datetime.timezone.utc)


def variant(spec):
    kind = getattr(ua.VariantType, spec["type"])
    value = spec["value"]
    if kind == ua.VariantType.DateTime:
        value = instant(value)
    elif kind == ua.VariantType.LocalizedText:
        value = ua.LocalizedText(value)
    return ua.Variant(value, kind)


def data(spec):
    return ua.DataValue(
        variant(spec) if "value" in spec else None,
        ua.StatusCode(spec.get("status", 0)),
        SourceTimestamp=instant(spec.get("time_millis")) or datetime.datetime.now(datetime.timezone.utc),
    )


class Peer:
    def __init__(self, server, folder):
        self.server = server
        self.folder = folder
        self.counting = []
        self.alarms = {}

    async def add(self, spec):
        node = ua.NodeId.from_string(spec["id"])
        name = ua.QualifiedName(spec.get("name", spec["id"].split("=")[-1]), node.NamespaceIndex)
        variable = await self.folder.add_variable(node, name, variant(spec))
        if spec.get("unit"):
            unit = ua.EUInformation(
                NamespaceUri="http://www.opcfoundation.org/UA/units/un/cefact",
                UnitId=spec["unit"].get("id", -1),
                DisplayName=ua.LocalizedText(spec["unit"]["name"]),
            )
            await variable.add_property(0, "EngineeringUnits", unit)
        await self.server.write_attribute_value(variable.nodeid, data(spec))

    async def add_condition(self, name):
        node = ua.NodeId.from_string(name)
        await self.folder.add_object(node, ua.QualifiedName(name, node.NamespaceIndex))
        self.alarms[name] = await self.generator(node)

    async def generator(self, node):
        generator = await self.server.get_event_generator(ua.NodeId(ua.ObjectIds.AlarmConditionType))
        generator.event.NodeId = node
        generator.event.ConditionName = str(node)
        # asyncua leaves out what most alarms have.
        generator.event.add_property("ShelvingState/CurrentState/Id", None, ua.VariantType.NodeId)
        return generator

    async def alarm(self, name, fields):
        event = self.alarms[name].event
        for field, value in fields.items():
            value = ua.NodeId(value) if field == "ShelvingState/CurrentState/Id" else value
            value = ua.StatusCode(value) if field == "Quality" else value
            value = ua.LocalizedText(value) if field == "Message" else value
            setattr(event, field, value)
        await self.alarms[name].trigger(time_attr=instant(fields.get("time_millis")))

    async def count(self, ids, seconds):
        """Writes values that encode their node and the time."""
        number = 0
        while True:
            number += 1
            for place, node in enumerate(ids):
                value = ua.Variant((place + 1 << 24) + number, ua.VariantType.Int64)
                now = datetime.datetime.now(datetime.timezone.utc)
                await self.server.write_attribute_value(
                    ua.NodeId.from_string(node), ua.DataValue(value, SourceTimestamp=now)
                )
            await asyncio.sleep(seconds)

    async def execute(self, command):
        match command:
            case {"set": spec}:
                await self.server.write_attribute_value(ua.NodeId.from_string(spec["id"]), data(spec))
            case {"add": spec}:
                await self.add(spec)
            case {"count": ids, "seconds": seconds}:
                self.counting.append(asyncio.create_task(self.count(ids, seconds)))
            case {"alarm": name, "fields": fields}:
                await self.alarm(name, fields)
            case {"sessions": True}:
                # How many clients there are, for a test that one said goodbye.
                return len(self.server.bserver.clients)
            case _:
                raise ValueError(f"unknown command: {command}")


async def serve(port, spec):
    server = Server(user_manager=Users(spec.get("users", {}), spec.get("certificates", [])))
    server.iserver.bind_condition_methods = spec.get("condition_refresh", True)
    await server.init()
    await server.set_application_uri(APPLICATION)
    server.set_endpoint(f"opc.tcp://127.0.0.1:{port}/test")
    security = spec.get("security")
    if security:
        await server.load_certificate(security["certificate"])
        await server.load_private_key(security["key"])
        policies = [POLICIES[name] for name in security["policies"]]
        server.set_security_policy(policies, permission_ruleset=SimpleRoleRuleset())
    else:
        server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
    for uri in spec.get("namespaces", []):
        await server.register_namespace(uri)
    await server.register_namespace(NAMESPACE)
    folder = await server.nodes.objects.add_folder(2, "Test")
    peer = Peer(server, folder)
    for node in spec.get("nodes", []):
        await peer.add(node)
    for name in spec.get("conditions", []):
        await peer.add_condition(name)
    if "space" in spec:
        await opcua_space.build(server, 2)
        opcua_space.limit(**spec["space"])
    for depth in range(spec.get("depth", 0)):
        folder = await folder.add_folder(2, f"{depth}")
        await folder.add_variable(2, "V", 1.0)
    await server.start()
    for name, fields in spec.get("alarms", {}).items():
        await peer.alarm(name, fields)
    port = server.bserver._server.sockets[0].getsockname()[1]
    print("READY", port, flush=True)
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        try:
            answer = await peer.execute(json.loads(line))
            print("OK" if answer is None else answer, flush=True)
        except Exception as error:  # The test is told, and decides.
            print("ERROR", error, flush=True)
    await server.stop()


def make_certificates(folder, pairs):
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import rsa
    from cryptography.x509.oid import NameOID

    now = datetime.datetime.now(datetime.timezone.utc)
    for name, uri in pairs:
        key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        expired = datetime.timedelta(days=-1 if name.startswith("expired") else 30)
        usage = dict.fromkeys(
            ["key_agreement", "key_cert_sign", "crl_sign", "encipher_only", "decipher_only"], False
        ) | dict.fromkeys(
            ["digital_signature", "content_commitment", "key_encipherment", "data_encipherment"], True
        )
        names = [x509.UniformResourceIdentifier(uri), x509.DNSName("localhost")]
        certificate = (
            x509.CertificateBuilder()
            .subject_name(subject)
            .issuer_name(subject)
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - datetime.timedelta(days=2))
            .not_valid_after(now + expired)
            .add_extension(x509.SubjectAlternativeName(names), critical=False)
            .add_extension(x509.KeyUsage(**usage), critical=False)
            .sign(key, hashes.SHA256())
        )
        folder.joinpath(f"{name}.der").write_bytes(
            certificate.public_bytes(serialization.Encoding.DER)
        )
        folder.joinpath(f"{name}.pem").write_bytes(
            key.private_bytes(
                serialization.Encoding.PEM,
                serialization.PrivateFormat.PKCS8,
                serialization.NoEncryption(),
            )
        )


def main():
    logging.basicConfig(level=logging.CRITICAL)
    if sys.argv[1] == "--make":
        rest = sys.argv[3:]
        make_certificates(pathlib.Path(sys.argv[2]), zip(rest[::2], rest[1::2]))
        return
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("spec")
    arguments = parser.parse_args()
    asyncio.run(serve(arguments.port, json.loads(arguments.spec)))


main()
