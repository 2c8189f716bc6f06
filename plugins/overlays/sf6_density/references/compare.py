"""Compares the plugin's gas law with the reference equation of SF6 (Guder and Wagner 2009)
as CoolProp has it, and prints the worst deviation of each quantity.

    pip install CoolProp
    cargo build -p sf6_density --example print_values
    python plugins/overlays/sf6_density/references/compare.py target/debug/examples/print_values

Exits with 1 where a deviation is beyond its limit. A second argument, a number, compares
only one point in so many.
"""

import math
import subprocess
import sys

import CoolProp.CoolProp as CP

DAY = 86_400_000_000_000


def pressure(density, celsius):
    """Absolute pressure in MPa by the reference equation."""
    return CP.PropsSI("P", "T", celsius + 273.15, "D", density, "SF6") / 1e6


def saturated_density(celsius):
    """Density of saturated vapor in kg/m3; infinite above the critical point."""
    if celsius >= 45.5:
        return math.inf
    return CP.PropsSI("D", "T", celsius + 273.15, "Q", 1, "SF6")


def main():
    program = sys.argv[1]
    step = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    questions, checks = [], []

    def ask(question, quantity, expected, relative=True):
        questions.append(question)
        checks.append((quantity, question, expected, relative))

    points = [(d, t) for d in range(10, 61) for t in range(-40, 81, 2)]
    for density, celsius in points[::step]:
        if density > saturated_density(celsius):
            continue
        at = pressure(density, celsius)
        ask(f"at_20 {at!r} {celsius}", "pressure at 20 °C", pressure(density, 20.0))
        ask(f"density {at!r} {celsius}", "virial density", density)
    for celsius in range(-49, 45):
        saturated = CP.PropsSI("P", "T", celsius + 273.15, "Q", 1, "SF6") / 1e6
        ask(f"vapor {celsius}", "vapor pressure", saturated)
    full = CP.PropsSI("D", "T", 293.15, "P", 0.7e6, "SF6")
    for leak in (0.0, 0.5, 1.0, 5.0, 12.0):
        for warming in (-0.4, 0.0, 0.4):
            for hour in range(31 * 24):
                days = hour / 24
                density = full * (1 - leak / 100 * days / 365.25)
                celsius = 10 + warming * days + 6 * math.sin(days * math.tau)
                at = pressure(density, celsius)
                questions.append(f"trend {hour * DAY // 24} {at!r} {celsius!r}")
            ask("loss", f"loss at {abs(warming)} K a day", leak, relative=False)

    answers = subprocess.run(
        [program], input="\n".join(questions), capture_output=True, text=True, check=True
    ).stdout.split()
    assert len(answers) == len(checks), (len(answers), len(checks))
    worst = {}
    for (quantity, question, expected, relative), answer in zip(checks, answers):
        deviation = float(answer) - expected
        if relative:
            deviation *= 100 / expected
        if math.isnan(deviation) or abs(deviation) > abs(worst.get(quantity, (0,))[0]):
            worst[quantity] = (deviation, question)
    limits = {
        "pressure at 20 °C": (0.7, "%"),
        "virial density": (0.02, "%"),
        "vapor pressure": (0.01, "%"),
        "loss at 0.0 K a day": (0.1, "%/a"),
        "loss at 0.4 K a day": (0.1, "%/a"),
    }
    failed = False
    for quantity, (limit, unit) in limits.items():
        deviation, question = worst.get(quantity, (0.0, "-"))
        is_within = abs(deviation) <= limit
        failed |= not is_within
        word = "within" if is_within else "BEYOND"
        print(f"sf6_density: {quantity}: {deviation:+.4f} {unit}, {word} {limit} ({question})")
    print(f"sf6_density: {len(checks)} values")
    sys.exit(failed)


main()
