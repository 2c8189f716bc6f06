"""Connectivity of random networks beside that of pypowsybl.

The argument is a file with a network a line, as the plugin judged it: nodes, branches with their
ends, whether each is closed and whether an earth stops at it, the nodes of what feeds and of closed
earths, and for each node whether it is fed and earthed. Each network becomes two voltage levels of a
node-breaker model, one with all branches and one without those at which an earth stops. What
pypowsybl then calls one bus is connected.
"""

import json
import sys

import pypowsybl
from pandas import DataFrame


def frame(rows, *columns):
    return DataFrame(rows, columns=["id", *columns]).set_index("id")


def buses_of(cases):
    """The calculated bus of every node, by level and node."""
    levels, sections, loads, switches = [], [], [], []
    for number, case in enumerate(cases):
        for what in ("fed", "earthed"):
            level = f"{number}.{what}"
            levels.append((level, "NODE_BREAKER", 110.0))
            taken = case["nodes"]
            for node in range(case["nodes"]):
                sections.append((f"{level}.{node}", level, node))
                # Without a feeder it would be no bus.
                loads.append((f"{level}.load{node}", level, taken, 1.0, 0.0))
                switches.append((f"{level}.to{node}", level, "DISCONNECTOR", node, taken, False))
                taken += 1
            for index, (one, other, is_closed, stops_earth) in enumerate(case["branches"]):
                is_open = not is_closed or (stops_earth and what == "earthed")
                name = f"{level}.branch{index}"
                switches.append((name, level, "BREAKER", one, other, is_open))
    network = pypowsybl.network.create_empty()
    network.create_voltage_levels(frame(levels, "topology_kind", "nominal_v"))
    network.create_busbar_sections(frame(sections, "voltage_level_id", "node"))
    network.create_loads(frame(loads, "voltage_level_id", "node", "p0", "q0"))
    network.create_switches(
        frame(switches, "voltage_level_id", "kind", "node1", "node2", "open")
    )
    return network.get_busbar_sections()["bus_id"].to_dict()


def main():
    with open(sys.argv[1]) as file:
        cases = [json.loads(line) for line in file]
    buses = buses_of(cases)
    compared, different = 0, 0
    for number, case in enumerate(cases):
        for what, origins in (("fed", case["sources"]), ("earthed", case["earths"])):
            bus = [buses[f"{number}.{what}.{node}"] for node in range(case["nodes"])]
            assert all(bus), f"a node without a bus in case {number}"
            reached = {bus[node] for node in origins}
            for node, ours in enumerate(case[what]):
                compared += 1
                if ours != (bus[node] in reached):
                    different += 1
                    print(f"{what} of node {node} differs: {json.dumps(case)}")
    print(f"energisation: {len(cases)} networks, {compared} states, {different} differ from pypowsybl")
    sys.exit(different > 0 or compared == 0)


main()
