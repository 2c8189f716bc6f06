"""An IEC 61850 MMS server by libiec61850 (pyiec61850-ng): an independent peer for the
plugin's tests. It is under the GPL, so it stays in a process of its own.

    iec61850_server.py [--port N] SPEC

SPEC is JSON: {"tls": {"ca", "certificate", "key"}, "conf_rev": N, "stamp_seconds": S,
"report_bytes": N, "extra": N, "texts": BOOL, "units": [[SIUNIT, MULTIPLIER]]}, each of which may be left out. The IED is always the same (see `build`);
`extra` adds as many values of three phases to MMXU2, `Val1` and so on; `units` adds to MMXU3 a
value with each of them, `Val1` and so on, and voltages `Phs` of which phase A is in V; `texts`
adds a visible string GGIO1.Mode and the name plate LLN0.NamPlt. With
`stamp_seconds` the integers GGIO1.IntIn1 to IntIn3 have their own number in their bits 24
to 30 and count up in the others. `report_bytes`, with `tls` alone, is room for reports.

Prints `READY port`, then takes commands on stdin, JSON, one a line, and answers each with
`OK` or `ERROR why`:

    {"object": "LD0/MMXU1.TotW", "values": {"mag.f": 1.5}, "quality": BITS,
     "time_millis": T, "clock": "failed" | "unsynchronised"}
        changes attributes of a data object; all but the object may be left out. A value
        is a bool, an integer, a float, or a text, {"dbpos": N}, {"int64": N},
        {"uint32": N}
    {"connections": N}   fails unless so many clients are connected, within 10 s
"""

import argparse
import json
import socket
import sys
import threading
import time

import pyiec61850.pyiec61850 as lib

IED = "IED1"
ALL_TRIGGERS = (
    lib.TRG_OPT_DATA_CHANGED | lib.TRG_OPT_QUALITY_CHANGED | lib.TRG_OPT_GI | lib.TRG_OPT_INTEGRITY
)
OPTIONS = lib.RPT_OPT_SEQ_NUM | lib.RPT_OPT_TIME_STAMP | lib.RPT_OPT_REASON_FOR_INCLUSION
STAMPED = 3


def build(spec):
    """Builds the model; returns it, the objects to keep alive, and the data objects of whole reports."""
    model = lib.IedModel_create(IED)
    device = lib.LogicalDevice_create("LD0", model)
    zero = lib.LogicalNode_create("LLN0", device)
    node = lambda name: lib.toModelNode(lib.LogicalNode_create(name, device))
    measurements, breaker = node("MMXU1"), node("XCBR1")
    lib.CDC_ENS_create("Mod", lib.toModelNode(zero), 0)
    lib.CDC_MV_create("TotW", measurements, lib.CDC_OPTION_INST_MAG, False)
    lib.CDC_MV_create("TotVAr", measurements, 0, True)
    lib.CDC_WYE_create("PhV", measurements, lib.CDC_OPTION_PHASES_ABC)
    lib.CDC_DPS_create("Pos", breaker, 0)
    lib.CDC_BCR_create("OpCnt", breaker, 0)
    generic = node("GGIO1")
    lib.CDC_SPS_create("Ind1", generic, 0)
    lib.CDC_SPS_create("Ind2", generic, 0)
    for number in range(1, STAMPED + 1):
        lib.CDC_INS_create(f"IntIn{number}", generic, 0)
    tap, protection = node("ATCC1"), node("PTOC1")
    lib.CDC_BSC_create("TapChg", tap, 0, lib.CDC_CTL_MODEL_NONE, False)
    lib.CDC_ACT_create("Op", protection, 0)
    lib.CDC_SPG_create("Str", protection, 0)
    lib.CDC_ASG_create("StrVal", protection, 0, False)
    if spec.get("texts"):
        lib.CDC_VSS_create("Mode", generic, 0)
        lib.CDC_LPL_create("NamPlt", lib.toModelNode(zero), 0)
    more = node("MMXU2")
    for number in range(1, spec.get("extra", 0) + 1):
        lib.CDC_WYE_create(f"Val{number}", more, lib.CDC_OPTION_PHASES_ABC)

    if spec.get("units"):
        more = node("MMXU3")
        for number in range(len(spec["units"])):
            lib.CDC_MV_create(f"Val{number + 1}", more, 0, False)
        lib.CDC_WYE_create("Phs", more, lib.CDC_OPTION_PHASES_ABC)
        for name in units_of(spec):
            holder = lib.IedModel_getModelNodeByObjectReference(model, IED + name)
            lib.CAC_Unit_create("units", holder, True)

    def data_set(name, members):
        created = lib.DataSet_create(name, zero)
        for member in members:
            lib.DataSetEntry_create(created, member, -1, None)

    whole = ["MMXU1$MX$TotW", "MMXU1$MX$PhV", "XCBR1$ST$Pos", "GGIO1$ST$Ind1"]
    data_set("dsWhole", whole)
    data_set("dsParts", ["GGIO1$ST$Ind2$stVal", "GGIO1$ST$Ind2$q", "MMXU1$MX$TotVAr$mag$i"])
    data_set("dsMany", [f"MMXU2$MX$Val{n + 1}" for n in range(spec.get("extra", 0))])
    revision = spec.get("conf_rev", 1)
    blocks = [
        ("brcbA01", True, "dsWhole"),
        ("brcbB01", True, "dsParts"),
        ("urcbA01", False, "dsWhole"),
        ("urcbB01", False, "dsParts"),
        ("urcbM01", False, "dsMany"),
        ("urcbN01", False, None),
    ]
    if spec.get("units"):
        data_set("dsUnits", [f"MMXU3$MX$Val{n + 1}" for n in range(len(spec["units"]))])
        blocks.append(("urcbU01", False, "dsUnits"))
    for name, is_buffered, members in blocks:
        lib.ReportControlBlock_create(
            name, zero, None, is_buffered, members, revision, ALL_TRIGGERS, OPTIONS, 0, 0
        )
    return model


def units_of(spec):
    """Returns the units of data objects, by their references."""
    units = spec.get("units", [])
    of = {f"LD0/MMXU3.Val{number}": unit for number, unit in enumerate(units, 1)}
    return of | {"LD0/MMXU3.Phs.phsA": [29, 0]} if units else of


def tls(files):
    """Returns a TLS configuration that requires client certificates of the authority."""
    configuration = lib.TLSConfiguration_create()
    lib.TLSConfiguration_setChainValidation(configuration, True)
    lib.TLSConfiguration_setAllowOnlyKnownCertificates(configuration, False)
    for load, path in (
        (lib.TLSConfiguration_setOwnKeyFromFile, (files["key"], None)),
        (lib.TLSConfiguration_setOwnCertificateFromFile, (files["certificate"],)),
        (lib.TLSConfiguration_addCACertificateFromFile, (files["ca"],)),
    ):
        if not load(configuration, *path):
            raise ValueError(f"{path[0]} cannot be loaded")
    return configuration


class Server:
    def __init__(self, spec):
        self.model = build(spec)
        if "tls" in spec:
            # The binding takes settings of the server in this form alone.
            settings = lib.IedServerConfig_create()
            report_bytes = spec.get("report_bytes", 65536)
            lib.IedServerConfig_setReportBufferSizeForURCBs(settings, report_bytes)
            certificates = tls(spec["tls"])
            self.server = lib.IedServer_createWithConfig(self.model, certificates, settings)
        else:
            self.server = lib.IedServer_create(self.model)
        for name, (unit, multiplier) in units_of(spec).items():
            self.update(f"{name}.units.SIUnit", unit)
            self.update(f"{name}.units.multiplier", multiplier)

    def attribute(self, reference):
        node = lib.IedModel_getModelNodeByObjectReference(self.model, IED + reference)
        if not node:
            raise ValueError(f"there is no {reference}")
        return lib.toDataAttribute(node)

    def update(self, reference, value):
        attribute = self.attribute(reference)
        match value:
            case bool():
                lib.IedServer_updateBooleanAttributeValue(self.server, attribute, value)
            case int():
                lib.IedServer_updateInt32AttributeValue(self.server, attribute, value)
            case float():
                lib.IedServer_updateFloatAttributeValue(self.server, attribute, value)
            case str():
                lib.IedServer_updateVisibleStringAttributeValue(self.server, attribute, value)
            case {"dbpos": position}:
                lib.IedServer_updateDbposValue(self.server, attribute, position)
            case {"int64": number}:
                lib.IedServer_updateInt64AttributeValue(self.server, attribute, number)
            case {"uint32": number}:
                lib.IedServer_updateUnsignedAttributeValue(self.server, attribute, number)
            case _:
                raise ValueError(f"no such value here: {value}")

    def stamp(self, attribute, millis, clock):
        stamp = lib.Timestamp_create()
        lib.Timestamp_clearFlags(stamp)
        lib.Timestamp_setTimeInMilliseconds(stamp, millis)
        lib.Timestamp_setClockFailure(stamp, clock == "failed")
        lib.Timestamp_setClockNotSynchronized(stamp, clock == "unsynchronised")
        lib.IedServer_updateTimestampAttributeValue(self.server, attribute, stamp)
        lib.Timestamp_destroy(stamp)

    def change(self, command):
        name = command["object"]
        # One report for all of it.
        lib.IedServer_lockDataModel(self.server)
        try:
            if "time_millis" in command:
                time_of_it = self.attribute(f"{name}.t")
                self.stamp(time_of_it, command["time_millis"], command.get("clock"))
            if "quality" in command:
                quality = self.attribute(f"{name}.q")
                lib.IedServer_updateQuality(self.server, quality, command["quality"])
            for part, value in command.get("values", {}).items():
                self.update(f"{name}.{part}", value)
        finally:
            lib.IedServer_unlockDataModel(self.server)

    def execute(self, command):
        if "object" in command:
            self.change(command)
        elif "connections" in command:
            deadline = time.monotonic() + 10
            while lib.IedServer_getNumberOfOpenConnections(self.server) != command["connections"]:
                if time.monotonic() > deadline:
                    found = lib.IedServer_getNumberOfOpenConnections(self.server)
                    raise RuntimeError(f"{found} clients are connected")
                time.sleep(0.01)
        else:
            raise ValueError(f"unknown command: {command}")

    def count(self, seconds):
        """Changes the stamped integers for ever."""
        attributes = [self.attribute(f"LD0/GGIO1.IntIn{n + 1}.stVal") for n in range(STAMPED)]
        for number in range(1 << 24):
            for index, attribute in enumerate(attributes, 1):
                value = index << 24 | number
                lib.IedServer_updateInt32AttributeValue(self.server, attribute, value)
            time.sleep(seconds)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("spec")
    options = parser.parse_args()
    spec = json.loads(options.spec)
    port = options.port or free_port()
    server = Server(spec)
    lib.IedServer_setLocalIpAddress(server.server, "127.0.0.1")
    lib.IedServer_start(server.server, port)
    if not lib.IedServer_isRunning(server.server):
        sys.exit(f"port {port} cannot be used")
    if "stamp_seconds" in spec:
        counting = (spec["stamp_seconds"],)
        threading.Thread(target=server.count, args=counting, daemon=True).start()
    print("READY", port, flush=True)

    for line in sys.stdin:
        try:
            server.execute(json.loads(line))
            print("OK", flush=True)
        except Exception as error:  # The test is told, and decides.
            print("ERROR", error, flush=True)
    # The library's threads do not let the interpreter end in order.
    sys.stdout.flush()
    lib.IedServer_stop(server.server)


main()
