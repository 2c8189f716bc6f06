"""A Modbus TCP client by pymodbus: reads what it is told to, and prints it.

    pymodbus_client.py PORT READS

READS is JSON: [[TABLE, UNIT, ADDRESS, COUNT], ...], with the tables holding, input,
coil and discrete. Prints one line of JSON: for each read the cells, or the number of
the exception.
"""

import json
import sys

from pymodbus.client import ModbusTcpClient


def read(client, table, unit, address, count):
    function = {
        "holding": client.read_holding_registers,
        "input": client.read_input_registers,
        "coil": client.read_coils,
        "discrete": client.read_discrete_inputs,
    }[table]
    response = function(address, count=count, device_id=unit)
    if response.isError():
        return response.exception_code
    return response.registers or [int(bit) for bit in response.bits[:count]]


def main():
    client = ModbusTcpClient("127.0.0.1", port=int(sys.argv[1]), timeout=10)
    if not client.connect():
        sys.exit("no connection")
    print(json.dumps([read(client, *wanted) for wanted in json.loads(sys.argv[2])]), flush=True)
    client.close()


main()
