"""An IEC 60870-5-104 controlling station by hat-drivers: sends requests one by one and
tells each message that comes.

    iec104_hat_client.py PORT

Connects, starts data transfer, and takes commands on stdin, JSON, one a line:

    {"interrogate": COMMON_ADDRESS, "group": QOI}
    {"counters": COMMON_ADDRESS, "group": RQT, "freeze": "READ"}
    {"clock": COMMON_ADDRESS}
    {"read": COMMON_ADDRESS, "ioa": N}
    {"listen": SECONDS}

Each is answered by a line of JSON: the messages that came until the request was
confirmed and over, or for these seconds; {"kind", "common_address", "ioa", "cause",
"type", "value", "time_millis", "is_negative"}.
"""

import asyncio
import calendar
import datetime
import json
import sys

from hat import aio
from hat.drivers import iec104, net

PATIENCE_SECONDS = 10


def value(data):
    value = data.value
    for name in ("value", "name"):
        value = getattr(value, name) if hasattr(value, name) else value
    return list(value) if isinstance(value, (bytes, memoryview)) else value


def millis(time):
    if time is None:
        return None
    date = (2000 + time.years, time.months, time.day_of_month, time.hours, time.minutes, 0)
    return calendar.timegm(date) * 1000 + time.milliseconds


def told(message):
    result = {
        "kind": type(message).__name__,
        "common_address": message.asdu_address,
        "cause": getattr(message.cause, "name", str(message.cause)),
        "is_negative": getattr(message, "is_negative_confirm", False),
    }
    if isinstance(message, iec104.DataMsg):
        result |= {
            "ioa": message.io_address,
            "type": type(message.data).__name__,
            "value": value(message.data),
            "time_millis": millis(message.time),
        }
    return result


def request(command):
    common = {"is_test": False, "originator_address": 0, "cause": iec104.CommandReqCause.ACTIVATION}
    if "interrogate" in command:
        return iec104.InterrogationMsg(
            asdu_address=command["interrogate"],
            request=command.get("group", 20),
            is_negative_confirm=False,
            **common,
        )
    if "counters" in command:
        return iec104.CounterInterrogationMsg(
            asdu_address=command["counters"],
            request=command.get("group", 5),
            freeze=iec104.FreezeCode[command.get("freeze", "READ")],
            is_negative_confirm=False,
            **common,
        )
    if "clock" in command:
        return iec104.ClockSyncMsg(
            is_test=False,
            originator_address=0,
            asdu_address=command["clock"],
            time=iec104.time_from_datetime(datetime.datetime.now(datetime.timezone.utc)),
            is_negative_confirm=False,
            cause=iec104.ClockSyncReqCause.ACTIVATION,
        )
    return iec104.ReadMsg(
        is_test=False,
        originator_address=0,
        asdu_address=command["read"],
        io_address=command["ioa"],
        cause=iec104.ReadReqCause.REQUEST,
    )


def is_end(sent, message):
    """Reports whether a message is the last answer to the request."""
    if isinstance(sent, iec104.ReadMsg):
        return isinstance(message, (iec104.DataMsg, iec104.ReadMsg)) and "SPONT" not in str(
            message.cause
        )
    if type(message) is not type(sent):
        return False
    is_clock = isinstance(sent, iec104.ClockSyncMsg)
    return message.is_negative_confirm or is_clock or "TERMINATION" in str(message.cause)


async def answers(connection, sent):
    messages = []
    while True:
        received = await asyncio.wait_for(connection.receive(), PATIENCE_SECONDS)
        messages.extend(received)
        if any(is_end(sent, message) for message in received):
            return messages


async def listen(connection, seconds):
    messages, loop = [], asyncio.get_running_loop()
    until = loop.time() + seconds
    while (left := until - loop.time()) > 0:
        try:
            messages.extend(await asyncio.wait_for(connection.receive(), left))
        except TimeoutError:
            break
    return messages


async def main():
    connection = await iec104.connect(net.TcpAddress("127.0.0.1", int(sys.argv[1])))
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        command = json.loads(line)
        if "listen" in command:
            messages = await listen(connection, command["listen"])
        else:
            sent = request(command)
            await connection.send([sent])
            messages = await answers(connection, sent)
        print(json.dumps([told(message) for message in messages]), flush=True)
    await connection.async_close()


aio.run_asyncio(main())
