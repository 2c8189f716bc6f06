"""A Modbus TCP server by pymodbus: an independent peer for the adapter's tests.

    pymodbus_server.py [--port N] [VALUES]

VALUES is JSON: {"holding": {"100": 42, "101": [1, 2]}, "coil": {"0": true}},
with the tables holding, input, coil and discrete. Addresses that are not given
are refused as illegal (bits come in groups of 16).

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
import sys

from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

READ_FUNCTION = {"coil": 1, "discrete": 2, "holding": 3, "input": 4}
# A table cannot be empty; this is out of the tests' way.
PLACEHOLDER_ADDRESS = 60_000


def table(values, name):
    """The cells of one table, as pymodbus wants them."""
    is_bits = name in ("coil", "discrete")
    kind = DataType.BITS if is_bits else DataType.REGISTERS
    cells = values.get(name) or {str(PLACEHOLDER_ADDRESS): 0}
    data = []
    for address, value in cells.items():
        value = value if isinstance(value, list) else [value]
        value = [bool(v) for v in value] if is_bits else [int(v) for v in value]
        data.append(SimData(int(address), values=value, datatype=kind))
    return data


async def obey(server, thawed, line):
    """Carries out one command; false to end."""
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
    parser.add_argument("values", nargs="?", default="{}")
    arguments = parser.parse_args()
    # Clients that go away are part of the tests.
    logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)
    values = json.loads(arguments.values)

    thawed = asyncio.Event()
    thawed.set()

    async def hold(*_):
        await thawed.wait()

    # Id 0 answers for every unit.
    names = ("coil", "discrete", "holding", "input")
    device = SimDevice(0, tuple(table(values, name) for name in names), action=hold)
    server = ModbusTcpServer(device, address=("127.0.0.1", arguments.port))
    await server.serve_forever(background=True)
    print("READY", server.transport.sockets[0].getsockname()[1], flush=True)

    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        try:
            if not await obey(server, thawed, line):
                break
            print("OK", flush=True)
        except Exception as error:  # The test is told, and decides.
            print("ERROR", error, flush=True)
    await server.shutdown()


asyncio.run(main())
