"""A Modbus server by pymodbus: an independent peer for the adapter's tests.

    pymodbus_server.py [--port N] [--tls FILES | --serial DEVICE] [VALUES]

It serves Modbus TCP; with --tls Modbus/TCP Security, to those alone whose
certificate the authority has signed: FILES is JSON, {"ca", "certificate", "key"};
with --serial Modbus RTU.

VALUES is JSON: {"holding": {"100": 42, "101": [1, 2]}, "coil": {"0": true}},
with the tables holding, input, coil and discrete. Addresses that are not given
are refused as illegal (bits come in groups of 16). All units have these values;
{"units": {"1": VALUES, "2": VALUES}} gives each its own, and on a serial line
nobody answers for others.

Prints `READY port`, then takes commands on stdin, one a line, and answers each
with `OK` or `ERROR why`:

    set TABLE ADDRESS VALUE...   changes values
    freeze                       leaves requests without an answer
    thaw                         answers again, those held back too
    quit                         ends, as does the end of stdin
"""

import argparse
import asyncio
import json
import logging
import ssl
import sys

from pymodbus import FramerType
from pymodbus.server import ModbusSerialServer, ModbusTcpServer, ModbusTlsServer
from pymodbus.simulator import DataType, SimData, SimDevice

READ_FUNCTION = {"coil": 1, "discrete": 2, "holding": 3, "input": 4}
# A table cannot be empty; this is out of the tests' way.
PLACEHOLDER_ADDRESS = 60_000


def table(values, name):
    """Returns the cells of one table in the form of pymodbus."""
    is_bits = name in ("coil", "discrete")
    kind = DataType.BITS if is_bits else DataType.REGISTERS
    cells = values.get(name) or {str(PLACEHOLDER_ADDRESS): 0}
    data = []
    for address, value in cells.items():
        value = value if isinstance(value, list) else [value]
        value = [bool(v) for v in value] if is_bits else [int(v) for v in value]
        data.append(SimData(int(address), values=value, datatype=kind))
    return data


def security(files):
    """Demands a certificate, as Modbus/TCP Security does."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(files["certificate"], files["key"])
    context.load_verify_locations(files["ca"])
    context.verify_mode = ssl.CERT_REQUIRED
    return context


def server_of(arguments, devices):
    if arguments.serial:
        units = {device.id for device in devices}

        def mute(is_sent, packet):
            # pymodbus answers for units that are not there, whatever it is told.
            return b"" if is_sent and units != {0} and packet[0] not in units else packet

        return ModbusSerialServer(devices, port=arguments.serial, trace_packet=mute)
    address = ("127.0.0.1", arguments.port)
    if arguments.tls:
        # The frames are those of Modbus TCP; pymodbus's TLS framer leaves their
        # headers away.
        context = security(json.loads(arguments.tls))
        return ModbusTlsServer(
            devices, framer=FramerType.SOCKET, address=address, sslctx=context
        )
    return ModbusTcpServer(devices, address=address)


async def execute(server, thawed, line):
    """Executes one command; returns false to end."""
    words = line.split()
    match words:
        case ["set", name, address, *values] if name in READ_FUNCTION and values:
            cast = int if name in ("holding", "input") else lambda v: bool(int(v))
            held = not thawed.is_set()
            thawed.set()
            await server.async_setValues(
                0, READ_FUNCTION[name], int(address), [cast(v) for v in values]
            )
            if held:
                thawed.clear()
        case ["freeze"]:
            thawed.clear()
        case ["thaw"]:
            thawed.set()
        case ["quit"]:
            return False
        case _:
            raise ValueError(f"unknown command: {line.strip()}")
    return True


async def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--tls")
    parser.add_argument("--serial")
    parser.add_argument("values", nargs="?", default="{}")
    arguments = parser.parse_args()
    # Clients that go away are part of the tests.
    logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)
    values = json.loads(arguments.values)

    thawed = asyncio.Event()
    thawed.set()

    async def hold(*_):
        await thawed.wait()

    def device(unit, values):
        names = ("coil", "discrete", "holding", "input")
        return SimDevice(unit, tuple(table(values, name) for name in names), action=hold)

    # Id 0 answers for every unit.
    units = values.get("units", {"0": values})
    server = server_of(arguments, [device(int(unit), own) for unit, own in units.items()])
    await server.serve_forever(background=True)
    port = 0 if arguments.serial else server.transport.sockets[0].getsockname()[1]
    print("READY", port, flush=True)

    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        try:
            if not await execute(server, thawed, line):
                break
            print("OK", flush=True)
        except Exception as error:  # The test is told, and decides.
            print("ERROR", error, flush=True)
    await server.shutdown()


asyncio.run(main())
