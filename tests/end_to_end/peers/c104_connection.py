"""Shared parts of the clients by c104: filters of data units, and connecting."""

import sys
import time

# Of an APDU: where the type and the cause of its data unit lie.
TYPE_INDEX, CAUSE_INDEX = 6, 8


def is_of(frame, types, cause, cause_bits):
    """Reports whether a frame has a data unit of one of these types, sent for this cause."""
    return (
        len(frame) > CAUSE_INDEX
        and frame[TYPE_INDEX] in types
        and frame[CAUSE_INDEX] & cause_bits == cause
    )


def open_transfer(client, connection, patience_seconds):
    """Starts the client, waits until it is connected, and starts data transfer."""
    client.start()
    until = time.monotonic() + patience_seconds
    while not connection.is_connected:
        if time.monotonic() > until:
            sys.exit("no connection")
        time.sleep(0.02)
    connection.unmute()
