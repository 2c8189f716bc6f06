"""Compares series of the thermal model with two independent implementations.

Reads the CSV of the example `series` from standard input or a file, works the same series out with the
package transformer-thermal-model (PyPI, MPL-2.0) and with the difference equations of
IEC 60076-7:2018, annex C, in steps of a tenth of a minute, and prints the worst deviation of
each quantity as CSV. Exit status 1 where one is above its limit.

    pip install transformer-thermal-model
    cargo run -p transformer_thermal --example series -- 100 1 | python compare.py
"""

import math
import sys

import pandas as pd

from transformer_thermal_model.aging import aging_rate_profile
from transformer_thermal_model.cooler import CoolerType
from transformer_thermal_model.model import Model
from transformer_thermal_model.schemas import InputProfile, UserTransformerSpecifications
from transformer_thermal_model.schemas.thermal_model.initial_state import InitialLoad
from transformer_thermal_model.transformer import PaperInsulationType, PowerTransformer

FIRST_LOAD = 0.5
STEP_MINUTES = 0.1
# Worst deviation allowed of each quantity, with its unit.
LIMITS = {
    ("package", "top_oil"): (0.001, "K"),
    ("package", "hot_spot"): (0.001, "K"),
    ("package", "ageing"): (0.0001, "relative"),
    ("package", "ageing_upgraded"): (0.0001, "relative"),
    ("difference_equations", "top_oil"): (0.1, "K"),
    ("difference_equations", "hot_spot"): (0.3, "K"),
}


def by_package(rows):
    """Series of the package."""
    first = rows.iloc[0]
    specifications = UserTransformerSpecifications(
        load_loss=first.loss_ratio,
        no_load_loss=1.0,
        nom_load_sec_side=1.0,
        amb_temp_surcharge=0.0,
        time_const_oil=first.oil_minutes,
        time_const_windings=first.winding_minutes,
        top_oil_temp_rise=first.top_oil_rise,
        winding_oil_gradient=first.gradient,
        hot_spot_fac=first.hot_spot_factor,
        oil_const_k11=first.k11,
        winding_const_k21=round(first.k21),
        winding_const_k22=first.k22,
        oil_exp_x=first.x,
        winding_exp_y=first.y,
        end_temp_reduction=0.0,
    )
    transformer = PowerTransformer(user_specs=specifications, cooling_type=CoolerType.ONAN)
    # The package reads whole numbers alone; its equations take those of OF cooling too.
    transformer.specs.winding_const_k21 = first.k21
    index = pd.to_datetime("2024-01-01") + pd.to_timedelta(rows.minute.values, unit="min")
    profile = InputProfile.create(
        datetime_index=index,
        load_profile=pd.Series(rows.load.values, index=index),
        ambient_temperature_profile=pd.Series(rows.ambient.values, index=index),
    )
    model = Model(
        temperature_profile=profile,
        transformer=transformer,
        initial_condition=InitialLoad(initial_load=FIRST_LOAD),
    )
    results = model.run()
    hot_spot = results.hot_spot_temp_profile
    return {
        "top_oil": list(results.top_oil_temp_profile),
        "hot_spot": list(hot_spot),
        "ageing": list(aging_rate_profile(hot_spot, PaperInsulationType.NORMAL)),
        "ageing_upgraded": list(aging_rate_profile(hot_spot, PaperInsulationType.THERMAL_UPGRADED)),
    }


def by_difference_equations(rows):
    """Series of the difference equations of annex C."""
    first = rows.iloc[0].to_dict()
    hot_spot_rise = first["hot_spot_factor"] * first["gradient"]
    k21 = first["k21"]
    oil_minutes = first["k11"] * first["oil_minutes"]
    fast_minutes = first["k22"] * first["winding_minutes"]
    slow_minutes = first["oil_minutes"] / first["k22"]

    def steady(load):
        losses = (1.0 + load * load * first["loss_ratio"]) / (1.0 + first["loss_ratio"])
        rise = hot_spot_rise * load ** first["y"]
        return first["top_oil_rise"] * losses ** first["x"], k21 * rise, (k21 - 1.0) * rise

    oil, fast, slow = steady(FIRST_LOAD)
    oil += first["ambient"]
    series = {"top_oil": [oil], "hot_spot": [oil + fast - slow]}
    minutes, loads, ambients = (list(rows[name]) for name in ("minute", "load", "ambient"))
    for before, minute, load, ambient in zip(minutes, minutes[1:], loads[1:], ambients[1:]):
        steps = math.ceil((minute - before) / STEP_MINUTES)
        step = (minute - before) / steps
        to_oil, to_fast, to_slow = steady(load)
        to_oil += ambient
        for _ in range(steps):
            oil += step / oil_minutes * (to_oil - oil)
            fast += step / fast_minutes * (to_fast - fast)
            slow += step / slow_minutes * (to_slow - slow)
        series["top_oil"].append(oil)
        series["hot_spot"].append(oil + fast - slow)
    return series


def main():
    table = pd.read_csv(sys.argv[1] if len(sys.argv) > 1 else sys.stdin)
    worst = dict.fromkeys(LIMITS, 0.0)
    for _, rows in table.groupby("profile"):
        references = {"package": by_package(rows), "difference_equations": by_difference_equations(rows)}
        for reference, quantity in LIMITS:
            theirs = references[reference][quantity]
            for ours, other in zip(rows[quantity], theirs, strict=True):
                deviation = abs(ours - other)
                if LIMITS[reference, quantity][1] == "relative":
                    deviation /= abs(other)
                # What is no number deviates from any.
                deviation = math.inf if math.isnan(deviation) else deviation
                worst[reference, quantity] = max(worst[reference, quantity], deviation)
    print("reference,quantity,points,worst,unit,limit,verdict")
    for (reference, quantity), deviation in worst.items():
        limit, unit = LIMITS[reference, quantity]
        verdict = "ok" if deviation <= limit else "DEVIATES"
        print(f"{reference},{quantity},{len(table)},{deviation:.3g},{unit},{limit},{verdict}")
    sys.exit(any(deviation > LIMITS[key][0] for key, deviation in worst.items()))


if __name__ == "__main__":
    main()
