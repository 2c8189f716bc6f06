"""An MQTT client by paho-mqtt that publishes what the tests want.

    mqtt_publisher.py --port N [SPEC]

SPEC is JSON, and all of it may be left out: {"version": 3 or 5, "will": MESSAGE,
"tls": {"ca", "certificate", "key"}, "username", "password"}. A MESSAGE is {"topic",
"payload": text, "qos", "retain"}.

Prints `READY`, then takes commands on stdin, JSON, one a line, and answers each with
`OK` or `ERROR why`:

    {"publish": MESSAGE}            confirmed by the broker where its qos is not 0
    {"count": MESSAGE, "to": N}     the payloads 1 to N on one topic
    {"stamp": MESSAGE, "topics": [TEXT], "seconds": S}   from now on, every S seconds, each
                                    topic gets its index in bits 24 and up, below it a
                                    number that counts up
    {"break": true}                 ends the connection without a word
    {"received": TEXT, "count": N}  waits until N messages came on a topic
"""

import argparse
import json
import sys
import threading
import time

from paho.mqtt import client as mqtt

PATIENCE_SECONDS = 10
LOOK_SECONDS = 0.01

arrived = {}


def connect(port, spec):
    version = {3: mqtt.MQTTv311, 5: mqtt.MQTTv5}[spec.get("version", 3)]
    client = mqtt.Client(protocol=version)
    if "will" in spec:
        will = spec["will"]
        client.will_set(
            will["topic"], will["payload"], will.get("qos", 1), will.get("retain", True)
        )
    if "username" in spec:
        client.username_pw_set(spec["username"], spec.get("password"))
    if "tls" in spec:
        tls = spec["tls"]
        client.tls_set(tls["ca"], tls.get("certificate"), tls.get("key"))
    connected = threading.Event()
    client.on_connect = lambda *_: connected.set()
    client.on_message = note
    client.connect("127.0.0.1", port, keepalive=30)
    client.loop_start()
    if not connected.wait(PATIENCE_SECONDS):
        raise TimeoutError("no connection")
    return client


def note(_client, _data, message):
    arrived.setdefault(message.topic, []).append(message.payload)


def publish(client, message, payload=None):
    info = client.publish(
        message["topic"],
        message["payload"] if payload is None else payload,
        message.get("qos", 1),
        message.get("retain", False),
    )
    info.wait_for_publish(PATIENCE_SECONDS)


def stamp(client, command):
    number = 0
    while True:
        number += 1
        for index, topic in enumerate(command["topics"], 1):
            client.publish(topic, str(index << 24 | number), command["stamp"].get("qos", 1))
        time.sleep(command["seconds"])


def execute(client, command):
    if "publish" in command:
        publish(client, command["publish"])
    elif "count" in command and "to" in command:
        for number in range(1, command["to"] + 1):
            publish(client, command["count"], str(number))
    elif "stamp" in command:
        threading.Thread(target=stamp, args=(client, command), daemon=True).start()
    elif "break" in command:
        client.loop_stop()
        client.socket().close()
    elif "received" in command:
        topic, count = command["received"], command["count"]
        if topic not in arrived:
            client.subscribe(topic, 1)
        deadline = time.monotonic() + PATIENCE_SECONDS
        while len(arrived.setdefault(topic, [])) < count:
            if time.monotonic() > deadline:
                raise TimeoutError(f"{len(arrived[topic])} of {count}: {arrived[topic]}")
            time.sleep(LOOK_SECONDS)
    else:
        raise ValueError(f"no such command: {command}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("spec", nargs="?", default="{}")
    arguments = parser.parse_args()
    client = connect(arguments.port, json.loads(arguments.spec))
    print("READY", flush=True)
    for line in sys.stdin:
        try:
            execute(client, json.loads(line))
            print("OK", flush=True)
        except Exception as error:
            print(f"ERROR {error!r}", flush=True)


main()
