"""Address space with every kind of node that can be browsed, for opcua_asyncua.py, and
limits of a server on browsing, which asyncua does not have."""

import asyncio
import uuid

from asyncua import ua
from asyncua.server.uaprocessor import UaProcessor
from asyncua.ua.ua_binary import struct_from_binary

# Each with a value, and what a tag of it shows is in the test.
SCALARS = {
    "Boolean": True,
    "SByte": -7,
    "Byte": 200,
    "Int16": -3000,
    "UInt16": 60000,
    "Int32": -100000,
    "UInt32": 4000000000,
    "Int64": -5000000000,
    "UInt64": 5000000000,
    "Float": 1.5,
    "Double": -2.25,
    "StatusCode": ua.StatusCode(ua.StatusCodes.BadTimeout),
    "String": "CLOSED",
    "LocalizedText": ua.LocalizedText("open"),
    "DateTime": None,
    "Guid": None,
    "ByteString": b"\x01\x02",
}


def texts(names):
    return [ua.LocalizedText(name) for name in names]


async def build(server, index):
    """Makes the folder Station below Objects, in namespace `index`."""

    def node(name):
        return ua.NodeId(name, index)

    def named(name):
        return ua.QualifiedName(name, index)

    async def variable(parent, name, value, kind, **more):
        return await parent.add_variable(node(f"Station.{name}"), named(name.split(".")[-1]), value, kind, **more)

    kind = ua.VariantType
    station = await server.nodes.objects.add_folder(node("Station"), named("Station"))

    types = await station.add_folder(node("Types"), named("Types"))
    for name, value in SCALARS.items():
        if name == "DateTime":
            value = (await server.nodes.server.get_child(["0:ServerStatus", "0:StartTime"])).nodeid
            value = await server.get_node(value).read_value()
        if name == "Guid":
            value = uuid.UUID("09087e75-8e5e-499b-954f-f2a9603db28a")
        await variable(types, f"Types.{name}", value, getattr(kind, name))

    bay = await station.add_object(node("Bay"), named("Bay 1"))
    voltage = await variable(bay, "Voltage", 230.5, kind.Double)
    await voltage.add_property(0, "EURange", ua.Range(0.0, 400.0))
    unit = ua.EUInformation(DisplayName=ua.LocalizedText("kV"))
    await voltage.add_property(0, "EngineeringUnits", unit)
    described = ua.DataValue(ua.Variant(ua.LocalizedText('Voltage, "L1-L2"'), kind.LocalizedText))
    await voltage.write_attribute(ua.AttributeIds.Description, described)

    breaker = await variable(bay, "Breaker", 2, kind.UInt32)
    dbpos = texts(["intermediate-state", "off", "on", "bad-state"])
    await breaker.add_property(0, "EnumStrings", dbpos)
    earthing = await variable(bay, "Earthing", False, kind.Boolean)
    await earthing.add_property(0, "TrueState", ua.LocalizedText("Open"))
    await earthing.add_property(0, "FalseState", ua.LocalizedText("Closed"))
    alarm = await variable(bay, "Pump", True, kind.Boolean)
    await alarm.add_property(0, "TrueState", ua.LocalizedText("Running"))
    await alarm.add_property(0, "FalseState", ua.LocalizedText("Stopped"))

    # An enumeration of the server's own, and a number that is derived from one.
    mode = await server.nodes.enum_data_type.add_data_type(node("Mode"), named("Mode"))
    values = [
        ua.EnumValueType(Value=number, DisplayName=ua.LocalizedText(name))
        for number, name in [(1, "Manual"), (5, "Automatic")]
    ]
    await mode.add_property(0, "EnumValues", values)
    await variable(bay, "Mode", 5, kind.Int32, datatype=mode.nodeid)
    double = server.get_node(ua.ObjectIds.Double)
    pressure = await double.add_data_type(node("Pressure"), named("Pressure"))
    await variable(bay, "Gas", 6.5, kind.Double, datatype=pressure.nodeid)

    phases = await variable(bay, "Phases", [1.0, 2.0, 3.0], kind.Double)
    await phases.write_value_rank(ua.ValueRank.OneDimension)
    await phases.write_array_dimensions([3])
    # Of any type, and of any number of elements: the values say it.
    await variable(bay, "Any", 12, kind.Int16, datatype=ua.NodeId(ua.ObjectIds.BaseDataType))
    loose = await variable(bay, "Loose", [True, False], kind.Boolean)
    await loose.write_value_rank(ua.ValueRank.ScalarOrOneDimension)
    await loose.write_array_dimensions([])
    matrix = await variable(bay, "Matrix", [[1, 2], [3, 4]], kind.Int32)
    await matrix.write_value_rank(ua.ValueRank.TwoDimensions)
    closed = await variable(bay, "Closed", 1.0, kind.Double)
    await closed.unset_attr_bit(ua.AttributeIds.UserAccessLevel, ua.AccessLevel.CurrentRead)

    # Two of one name, a way round in a circle, and a second way to the same variable.
    for place in ("A", "B"):
        await bay.add_variable(node(f"Twin {place}"), named("Twin"), 1.0, kind.Double)
    # asyncua refuses circles by its services; other servers have them.
    back = ua.ReferenceDescription(
        ReferenceTypeId=ua.NodeId(ua.ObjectIds.Organizes),
        IsForward=True,
        NodeId=station.nodeid,
        BrowseName=named("Station"),
        DisplayName=ua.LocalizedText("Station"),
        NodeClass=ua.NodeClass.Object,
    )
    server.iserver.aspace[bay.nodeid].references.append(back)
    await station.add_reference(voltage, ua.ObjectIds.Organizes)


def limit(nodes=None, references=None, points=None, reads=None, freeze_after=None):
    """Makes servers refuse more nodes of a Browse or Read, give few references at once and
    keep few places to go on from; after some requests to browse they are silent."""
    process = UaProcessor._process_message
    rest = {}
    count = [0, 0]

    def is_request(typeid, name):
        return typeid == ua.NodeId(getattr(ua.ObjectIds, f"{name}Request_Encoding_DefaultBinary"))

    def cut(results):
        for result in results:
            if not references or len(result.References) <= references:
                continue
            if points is not None and len(rest) >= points:
                result.References = []
                result.StatusCode = ua.StatusCode(ua.StatusCodes.BadNoContinuationPoints)
                continue
            count[1] += 1
            point = str(count[1]).encode()
            rest[point] = result.References[references:]
            result.References = result.References[:references]
            result.ContinuationPoint = point
        return results

    async def limited(self, typeid, requesthdr, seqhdr, body):
        if is_request(typeid, "Browse") or is_request(typeid, "BrowseNext"):
            count[0] += 1
            if freeze_after is not None and count[0] > freeze_after:
                await asyncio.sleep(3600)
        if is_request(typeid, "Browse"):
            params = struct_from_binary(ua.BrowseParameters, body)
            if nodes and len(params.NodesToBrowse) > nodes:
                raise ua.uaerrors.BadTooManyOperations
            response = ua.BrowseResponse()
            response.Results = cut(await self.session.browse(params))
        elif is_request(typeid, "BrowseNext"):
            params = struct_from_binary(ua.BrowseNextParameters, body)
            results = []
            for point in params.ContinuationPoints:
                result = ua.BrowseResult()
                if point in rest:
                    result.References = rest.pop(point)
                else:
                    result.StatusCode = ua.StatusCode(ua.StatusCodes.BadContinuationPointInvalid)
                results.append(result)
            response = ua.BrowseNextResponse()
            response.Parameters.Results = cut(results)
        elif is_request(typeid, "Read") and reads:
            copy = body.copy(len(body))
            if len(struct_from_binary(ua.ReadParameters, copy).NodesToRead) > reads:
                raise ua.uaerrors.BadTooManyOperations
            return await process(self, typeid, requesthdr, seqhdr, body)
        else:
            return await process(self, typeid, requesthdr, seqhdr, body)
        self.send_response(requesthdr.RequestHandle, seqhdr, response)
        return True

    UaProcessor._process_message = limited
