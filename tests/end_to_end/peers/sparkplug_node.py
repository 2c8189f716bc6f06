"""An edge node of Sparkplug B by pysparkplug, which says what the tests want.

    sparkplug_node.py --port N GROUP EDGE_NODE

Prints `READY`, then takes commands on stdin, JSON, one a line, and answers each with
`OK` or `ERROR why`. Without "device" they are about the edge node itself:

    {"birth": [METRIC], "device": ID}     an NBIRTH has sequence number 0
    {"data": [METRIC], "device": ID, "skip": N}   N sequence numbers are left out before
    {"death": true, "device": ID}
    {"old_death": N}                a death certificate of the node's life N
    {"break": true}                 ends the connection without a word: the broker tells
    {"commands": N}                 waits until N requests for a rebirth have come
    {"state": HOST, "online": BOOL} waits until a primary host says so

A METRIC is {"name", "alias", "type": "INT32", "value", "time": milliseconds since 1970,
"quality": code, "unit": text, "is_null", "is_historical"}; all but one of name and alias may be left out,
and the type of DATASET needs no value.
"""

import argparse
import datetime
import json
import sys
import time

from pysparkplug import (
    Client,
    DataType,
    Message,
    MessageType,
    Metric,
    NDeath,
    QoS,
    Topic,
    get_current_timestamp,
)
from pysparkplug import _protobuf as protobuf

PATIENCE_SECONDS = 10
LOOK_SECONDS = 0.01
REBIRTH = "Node Control/Rebirth"


class Raw:
    """A payload that was put together by hand."""

    def __init__(self, payload):
        self.payload = payload

    def encode(self, *, include_dtypes=False):
        return self.payload.SerializeToString()


def metric_of(metric, is_birth):
    kind = DataType[metric.get("type", "UNKNOWN")]
    value = metric.get("value")
    if kind is DataType.DATETIME:
        value = datetime.datetime.fromtimestamp(value / 1000, datetime.timezone.utc)
    is_dataset = kind is DataType.DATASET
    raw = Metric(
        timestamp=metric.get("time"),
        name=metric.get("name"),
        datatype=DataType.STRING if is_dataset else kind,
        value="" if is_dataset else value,
        alias=metric.get("alias"),
        is_historical=metric.get("is_historical", False),
        is_null=metric.get("is_null", False),
    ).to_pb(include_dtype=is_birth)
    if is_dataset:
        raw.dataset_value.num_of_columns = 0
        raw.datatype = int(kind) if is_birth else 0
    if "quality" in metric:
        raw.properties.keys.append("Quality")
        quality = raw.properties.values.add()
        quality.type = int(DataType.INT32)
        quality.int_value = metric["quality"]
    if "unit" in metric:
        raw.properties.keys.append("engUnit")
        unit = raw.properties.values.add()
        unit.type = int(DataType.STRING)
        unit.string_value = metric["unit"]
    return raw


class Node:
    def __init__(self, port, group, node):
        self.group, self.node, self.port = group, node, port
        self.life, self.sequence = -1, 0
        self.rebirths, self.states = 0, {}
        self.connect()

    def connect(self):
        self.life += 1
        self.client = Client()
        death = NDeath(timestamp=get_current_timestamp(), bd_seq_metric=self.bd_seq())
        self.client.set_will(
            Message(self.topic(MessageType.NDEATH), death, QoS.AT_LEAST_ONCE, False)
        )
        self.client.subscribe(
            self.topic(MessageType.NCMD), QoS.AT_LEAST_ONCE, self.note_command
        )
        self.client.connect("127.0.0.1", port=self.port)
        deadline = time.monotonic() + PATIENCE_SECONDS
        while not self.client._client.is_connected():
            if time.monotonic() > deadline:
                raise TimeoutError("no connection")
            time.sleep(LOOK_SECONDS)

    def note_command(self, _client, message):
        names = [metric.name for metric in message.payload.metrics]
        self.rebirths += names == [REBIRTH]

    def topic(self, kind, device=None):
        return Topic(
            message_type=kind,
            group_id=self.group,
            edge_node_id=self.node,
            device_id=device,
        )

    def bd_seq(self, life=None):
        value = self.life if life is None else life
        return Metric(
            timestamp=get_current_timestamp(),
            name="bdSeq",
            datatype=DataType.INT64,
            value=value,
        )

    def send(self, kind, device, metrics, *, is_birth=False):
        payload = protobuf.Payload()
        payload.timestamp = get_current_timestamp()
        payload.seq = self.sequence
        self.sequence = (self.sequence + 1) % 256
        payload.metrics.extend(metric_of(metric, is_birth) for metric in metrics)
        if is_birth and device is None:
            payload.metrics.append(self.bd_seq().to_pb(include_dtype=True))
        self.publish(self.topic(kind, device), Raw(payload))

    def publish(self, topic, payload):
        raw = payload.encode(include_dtypes=True)
        info = self.client._client.publish(str(topic), raw, qos=1)
        info.wait_for_publish(PATIENCE_SECONDS)

    def execute(self, command):
        device = command.get("device")
        kinds = MessageType
        if "birth" in command:
            if device is None:
                self.sequence = 0
            kind = kinds.NBIRTH if device is None else kinds.DBIRTH
            self.send(kind, device, command["birth"], is_birth=True)
        elif "data" in command:
            self.sequence = (self.sequence + command.get("skip", 0)) % 256
            self.send(kinds.NDATA if device is None else kinds.DDATA, device, command["data"])
        elif "death" in command and device is not None:
            self.send(kinds.DDEATH, device, [])
        elif "death" in command or "old_death" in command:
            bd_seq = self.bd_seq(command.get("old_death"))
            death = NDeath(timestamp=get_current_timestamp(), bd_seq_metric=bd_seq)
            self.publish(self.topic(kinds.NDEATH), death)
        elif "break" in command:
            old = self.client._client
            old.loop_stop()
            old.socket().close()
            self.connect()
        elif "commands" in command:
            self.wait(lambda: self.rebirths >= command["commands"], "rebirths")
        elif "state" in command:
            self.wait_for_state(command["state"], command["online"])
        else:
            raise ValueError(f"no such command: {command}")

    def wait_for_state(self, host, online):
        if host not in self.states:
            self.states[host] = None

            def note(_client, _data, message):
                self.states[host] = json.loads(message.payload)["online"]

            self.client._client.message_callback_add(f"spBv1.0/STATE/{host}", note)
            self.client._client.subscribe(f"spBv1.0/STATE/{host}", 1)
        self.wait(lambda: self.states[host] is online, f"state {online}")

    def wait(self, is_so, what):
        deadline = time.monotonic() + PATIENCE_SECONDS
        while not is_so():
            if time.monotonic() > deadline:
                raise TimeoutError(what)
            time.sleep(LOOK_SECONDS)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("group")
    parser.add_argument("edge_node")
    arguments = parser.parse_args()
    node = Node(arguments.port, arguments.group, arguments.edge_node)
    print("READY", flush=True)
    for line in sys.stdin:
        try:
            node.execute(json.loads(line))
            print("OK", flush=True)
        except Exception as error:
            print(f"ERROR {error!r}", flush=True)


main()
