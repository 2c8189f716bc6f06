"""A Modbus TCP client by pymodbus that reads as fast as it can, one request at a time.

    modbus_rate.py PORT UNITS BLOCKS

Prints `READY`, then takes one JSON a line on stdin, {"seconds": S}: for so long it reads
blocks of 125 holding registers, one after the other, from 0 on, of units 1 to UNITS. It
answers with {"requests", "seconds"}.
"""

import asyncio
import itertools
import json
import sys
import time

from pymodbus.client import AsyncModbusTcpClient

REGISTERS = 125


async def main():
    port, units, blocks = (int(word) for word in sys.argv[1:4])
    wanted = itertools.cycle(
        [(unit, REGISTERS * block) for unit in range(1, units + 1) for block in range(blocks)]
    )
    client = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=5)
    if not await client.connect():
        sys.exit("no connection")
    print("READY", flush=True)
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        limit, count, begun = json.loads(line)["seconds"], 0, time.perf_counter()
        while (seconds := time.perf_counter() - begun) < limit:
            unit, address = next(wanted)
            response = await client.read_holding_registers(
                address, count=REGISTERS, device_id=unit
            )
            if response.isError() or len(response.registers) != REGISTERS:
                sys.exit(f"block {address} of unit {unit}: {response}")
            count += 1
        print(json.dumps({"requests": count, "seconds": seconds}), flush=True)
    client.close()


asyncio.run(main())
