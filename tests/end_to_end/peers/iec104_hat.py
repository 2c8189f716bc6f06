"""An IEC 60870-5-104 station by hat-drivers, which sends what the tests want: a
second independent peer, with types, causes and times that c104 does not send.

    iec104_hat.py [--port N] SPEC

SPEC is JSON: {"points": [POINT, ...], "stamp_seconds": S}, sent in answer to
interrogations. With stamp_seconds, which may be left out, every point gets a new
value in this period and is sent: its address in bits 24 to 30, below it a number
that counts up. A POINT
is {"common_address", "ioa", "type": "M_ME_NC_1", "value", "quality": bits of a
quality descriptor, "time": [year, month, day, hour, minute, milliseconds],
"is_time_invalid", "is_summer_time", "is_test", "cause"}; what follows the value may
be left out.

Prints `READY port`, then takes commands on stdin, JSON, one a line, and answers
each with `OK` or `ERROR why`:

    {"send": POINT}                 to every connection with data transfer
    {"count": POINT, "to": N}       the values 1 to N of a point
    {"connections": [M, N]}         fails unless M are open, N with data transfer
    {"close": true}                 closes the connection with data transfer
"""

import argparse
import asyncio
import json
import sys

from hat import aio
from hat.drivers import iec104, net

PATIENCE_SECONDS = 10
LOOK_SECONDS = 0.01

connections = set()


def time(point):
    if "time" not in point:
        return None
    year, month, day, hour, minute, milliseconds = point["time"]
    return iec104.Time(
        size=iec104.TimeSize.SEVEN,
        milliseconds=milliseconds,
        invalid=point.get("is_time_invalid", False),
        substituted=False,
        minutes=minute,
        summer_time=point.get("is_summer_time", False),
        hours=hour,
        day_of_week=1,
        day_of_month=day,
        months=month,
        years=year % 100,
    )


def data(point):
    kind, value, bits = point["type"], point["value"], point.get("quality", 0)
    four = [bool(bits & bit) for bit in (0x80, 0x40, 0x20, 0x10)]
    indication = iec104.IndicationQuality(*four)
    measurement = iec104.MeasurementQuality(*four, bool(bits & 0x01))
    protection = iec104.ProtectionQuality(*four, bool(bits & 0x08))
    match kind[2:4]:
        case "SP":
            return iec104.SingleData(iec104.SingleValue(int(value)), indication)
        case "DP":
            return iec104.DoubleData(iec104.DoubleValue(value), indication)
        case "ST":
            is_moving = point.get("is_moving", False)
            return iec104.StepPositionData(
                iec104.StepPositionValue(value, is_moving), measurement
            )
        case "BO":
            text = iec104.BitstringValue(value.to_bytes(4, "little"))
            return iec104.BitstringData(text, measurement)
        case "IT":
            counter = iec104.CounterQuality(four[0], bool(bits & 0x40), bool(bits & 0x20), 7)
            return iec104.BinaryCounterData(iec104.BinaryCounterValue(value), counter)
        case "PS":
            points = [bool(value >> bit & 1) for bit in range(16)]
            return iec104.StatusData(iec104.StatusValue(points, [True] * 16), measurement)
    match kind:
        case "M_ME_NA_1" | "M_ME_TD_1":
            return iec104.NormalizedData(iec104.NormalizedValue(value), measurement)
        case "M_ME_ND_1":
            return iec104.NormalizedData(iec104.NormalizedValue(value), None)
        case "M_ME_NB_1" | "M_ME_TE_1":
            return iec104.ScaledData(iec104.ScaledValue(value), measurement)
        case "M_ME_NC_1" | "M_ME_TF_1":
            return iec104.FloatingData(iec104.FloatingValue(value), measurement)
        case "M_EP_TD_1":
            return iec104.ProtectionData(iec104.ProtectionValue(value), protection, 25)
        case "M_EP_TE_1":
            bits = [bool(value >> bit & 1) for bit in range(6)]
            return iec104.ProtectionStartData(
                iec104.ProtectionStartValue(*bits), protection, 25
            )
        case "M_EP_TF_1":
            bits = [bool(value >> bit & 1) for bit in range(4)]
            return iec104.ProtectionCommandData(
                iec104.ProtectionCommandValue(*bits), protection, 25
            )
    raise ValueError(f"no such type here: {kind}")


def message(point, cause):
    name = point.get("cause", cause)
    return iec104.DataMsg(
        is_test=point.get("is_test", False),
        originator_address=0,
        asdu_address=point["common_address"],
        io_address=point["ioa"],
        data=data(point),
        time=time(point),
        cause=iec104.DataResCause[name],
    )


async def answer(connection, request, points):
    """Confirms an interrogation, sends the points, ends it."""
    cause = iec104.CommandResCause
    is_interrogation = isinstance(request, iec104.InterrogationMsg)
    if not is_interrogation and not isinstance(request, iec104.CounterInterrogationMsg):
        return
    own = [p for p in points if p["common_address"] == request.asdu_address]
    if not own:
        unknown = cause.UNKNOWN_ASDU_ADDRESS
        await connection.send([request._replace(cause=unknown, is_negative_confirm=True)])
        return
    wanted = [p for p in own if (p["type"][2:4] != "IT") == is_interrogation]
    name = "INTERROGATED_STATION" if is_interrogation else "INTERROGATED_COUNTER"
    await connection.send([request._replace(cause=cause.ACTIVATION_CONFIRMATION)])
    await connection.send([message(point, name) for point in wanted])
    await connection.send([request._replace(cause=cause.ACTIVATION_TERMINATION)])


async def serve(connection, points):
    connections.add(connection)
    try:
        while True:
            for request in await connection.receive():
                await answer(connection, request, points)
    except ConnectionError:
        pass
    finally:
        connections.discard(connection)
        await aio.uncancellable(connection.async_close())


def enabled():
    return [connection for connection in connections if connection.is_enabled]


async def stamp(points, period):
    number = 0
    while True:
        await asyncio.sleep(period)
        number += 1
        for point in points:
            point["value"] = point["ioa"] << 24 | number
        messages = [message(point, "SPONTANEOUS") for point in points]
        for connection in enabled():
            try:
                await connection.send(messages)
            except ConnectionError:
                pass


async def execute(command):
    match command:
        case {"send": point}:
            for connection in enabled():
                await connection.send([message(point, "SPONTANEOUS")])
        case {"count": point, "to": last}:
            for value in range(1, last + 1):
                for connection in enabled():
                    changed = point | {"value": value}
                    await connection.send([message(changed, "SPONTANEOUS")])
        case {"connections": [is_open, with_data]}:
            for _ in range(int(PATIENCE_SECONDS / LOOK_SECONDS)):
                if (len(connections), len(enabled())) == (is_open, with_data):
                    return
                await asyncio.sleep(LOOK_SECONDS)
            raise RuntimeError(f"{len(connections)} open, {len(enabled())} with data transfer")
        case {"close": True}:
            for connection in enabled():
                await connection.async_close()
        case _:
            raise ValueError(f"unknown command: {command}")


async def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("spec")
    arguments = parser.parse_args()
    spec = json.loads(arguments.spec)
    points = spec["points"]

    server = await iec104.listen(
        lambda connection: serve(connection, points),
        net.TcpAddress("127.0.0.1", arguments.port),
    )
    print("READY", server.info.addresses[0].port, flush=True)
    if "stamp_seconds" in spec:
        stamping = asyncio.create_task(stamp(points, spec["stamp_seconds"]))

    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        try:
            await execute(json.loads(line))
            print("OK", flush=True)
        except Exception as error:  # The test is told, and decides.
            print("ERROR", error, flush=True)
    await server.async_close()


asyncio.run(main())
