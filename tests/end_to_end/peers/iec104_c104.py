"""An IEC 60870-5-104 station by c104: an independent peer for the plugin's tests.

    iec104_c104.py [--port N] SPEC

SPEC is JSON: {"points": [POINT, ...], "tls": {"ca", "certificate", "key"}}, where
a POINT is {"common_address", "ioa", "type": "M_ME_NC_1", "value", "quality": bits
of a quality descriptor, "time_millis": Unix time}; quality and time may be left out.
{"floats": {"common_addresses": N, "points": M}} makes short floats besides, at the
object addresses 1 to M of the common addresses 1 to N.

Prints `READY port`, then takes commands on stdin, JSON, one a line, and answers
each with `OK` or `ERROR why`:

    {"set": POINT}                     changes a point and sends it, spontaneously
    {"count": POINT, "to": N}          sends the values 1 to N of a point
    {"initialised": COMMON_ADDRESS}    says that the station has started anew
    {"clock": true}                    fails unless the clock was set, within 10 s
"""

import argparse
import datetime
import json
import socket
import sys
import time

import c104

BLOCKED, SUBSTITUTED, NOT_TOPICAL, INVALID = 0x10, 0x20, 0x40, 0x80
# Of lib60870's queue, so that none is thrown away.
PAUSE_EVERY, PAUSE_SECONDS = 50, 0.02

clock_was_set = False


def quality(bits):
    names = {
        0x01: c104.Quality.Overflow,
        0x08: c104.Quality.ElapsedTimeInvalid,
        BLOCKED: c104.Quality.Blocked,
        SUBSTITUTED: c104.Quality.Substituted,
        NOT_TOPICAL: c104.Quality.NonTopical,
        INVALID: c104.Quality.Invalid,
    }
    result = c104.Quality()
    for bit, name in names.items():
        if bits & bit:
            result |= name
    return result


def info(point):
    """Returns the information class of c104 for a point."""
    kind, value, bits = point["type"][2:4], point["value"], point.get("quality", 0)
    more = {"quality": quality(bits)}
    if "time_millis" in point:
        seconds = point["time_millis"] / 1000
        more["recorded_at"] = datetime.datetime.fromtimestamp(seconds, datetime.timezone.utc)
    match kind:
        case "SP":
            return c104.SingleInfo(value, **more)
        case "DP":
            names = ("INTERMEDIATE", "OFF", "ON", "INDETERMINATE")
            return c104.DoubleInfo(getattr(c104.Double, names[value]), **more)
        case "ST":
            return c104.StepInfo(c104.Int7(value), False, **more)
        case "BO":
            # From a small int c104 makes zero.
            return c104.BinaryInfo(c104.Byte32(value.to_bytes(4, "little")), **more)
        case "IT":
            more["quality"] = c104.BinaryCounterQuality()
            if bits & INVALID:
                more["quality"] |= c104.BinaryCounterQuality.Invalid
            return c104.BinaryCounterInfo(value, c104.UInt5(3), **more)
    match point["type"]:
        case "M_ME_NA_1" | "M_ME_TD_1" | "M_ME_ND_1":
            return c104.NormalizedInfo(c104.NormalizedFloat(value), **more)
        case "M_ME_NB_1" | "M_ME_TE_1":
            return c104.ScaledInfo(c104.Int16(value), **more)
        case "M_ME_NC_1" | "M_ME_TF_1":
            return c104.ShortInfo(value, **more)
    raise ValueError(f"no such type here: {point['type']}")


def station(server, common_address):
    return server.get_station(common_address) or server.add_station(common_address)


def add(server, spec):
    owner = station(server, spec["common_address"])
    point = owner.add_point(spec["ioa"], getattr(c104.Type, spec["type"]))
    point.info = info(spec)


def send(server, spec):
    point = station(server, spec["common_address"]).get_point(spec["ioa"])
    point.info = info(spec)
    if not point.transmit(cause=c104.Cot.SPONTANEOUS):
        raise RuntimeError("c104 did not send it")


def execute(server, command):
    match command:
        case {"set": spec}:
            send(server, spec)
        case {"count": spec, "to": last}:
            for value in range(1, last + 1):
                send(server, spec | {"value": value})
                if value % PAUSE_EVERY == 0:
                    time.sleep(PAUSE_SECONDS)
        case {"initialised": common_address}:
            cause = c104.Coi.REMOTE_RESET
            station(server, common_address).signal_initialized(cause=cause)
        case {"clock": True}:
            deadline = time.monotonic() + 10
            while not clock_was_set:
                if time.monotonic() > deadline:
                    raise RuntimeError("nobody set the clock")
                time.sleep(0.01)
        case _:
            raise ValueError(f"unknown command: {command}")


def on_clock_sync(
    server: c104.Server, ip: str, date_time: datetime.datetime
) -> c104.ResponseState:
    global clock_was_set
    now = datetime.datetime.now(datetime.timezone.utc)
    # It comes without a zone.
    if abs(date_time.replace(tzinfo=now.tzinfo) - now) > datetime.timedelta(seconds=5):
        return c104.ResponseState.FAILURE
    clock_was_set = True
    return c104.ResponseState.SUCCESS


def security(files):
    tls = c104.TransportSecurity(validate=True, only_known=False)
    tls.set_certificate(cert=files["certificate"], key=files["key"])
    tls.set_ca_certificate(cert=files["ca"])
    return tls


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("spec")
    arguments = parser.parse_args()
    spec = json.loads(arguments.spec)

    options = {"ip": "127.0.0.1", "port": arguments.port or free_port(), "tick_rate_ms": 50}
    if "tls" in spec:
        options["transport_security"] = security(spec["tls"])
    server = c104.Server(**options)
    server.on_clock_sync(callable=on_clock_sync)
    for point in spec.get("points", []):
        add(server, point)
    floats = spec.get("floats", {"common_addresses": 0, "points": 0})
    for address in range(1, floats["common_addresses"] + 1):
        owner = station(server, address)
        for ioa in range(1, floats["points"] + 1):
            owner.add_point(ioa, c104.Type.M_ME_NC_1).value = float(ioa)
    server.start()
    print("READY", server.port, flush=True)

    for line in sys.stdin:
        try:
            execute(server, json.loads(line))
            print("OK", flush=True)
        except Exception as error:  # The test is told, and decides.
            print("ERROR", error, flush=True)
    server.stop()


main()
