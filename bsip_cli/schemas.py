"""Every artifact: its columns with type, unit, frame and meaning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Level = Literal["trial", "participant", "cohort"]


@dataclass(frozen=True)
class Column:
    """One column. ``name`` may end in ``*``: a family of columns of one type and meaning."""

    name: str
    type: Literal["float", "int", "bool", "text"]
    unit: str
    meaning: str
    frame: str = ""


@dataclass(frozen=True)
class Schema:
    kind: str
    level: Level
    version: int
    meaning: str
    columns: tuple[Column, ...]
    file: str = ""  # how its file's name ends, where another level has the same

    @property
    def file_name(self) -> str:
        return self.file or self.kind

    def column(self, name: str) -> Column | None:
        """The definition that a column of this name follows, or None."""
        for column in self.columns:
            if column.name == name:
                return column
            if column.name.endswith("*") and name.startswith(column.name[:-1]):
                return column
        return None


def _floats(names: str, unit: str, meaning: str, frame: str = "") -> tuple[Column, ...]:
    return tuple(Column(name, "float", unit, meaning, frame) for name in names.split())


def _text(name: str, meaning: str) -> Column:
    return Column(name, "text", "", meaning)


_TIME = Column("time_s", "float", "s", "time from the start of the recording")
_METHOD = _text(
    "method",
    "measured, RM, RM+mass, OM, another estimator, or OM+<effect>: extended",
)
_SEGMENT = _text("segment", "segment of the skeleton")
_WRENCH = (
    *_floats("fx_N fy_N fz_N", "N", "ground force on the body", "world"),
    *_floats("mx_Nm my_Nm mz_Nm", "N m", "moment about the world origin", "world"),
)
_VALID = Column("valid", "bool", "", "every contact with the ground is on a plate")
_INERTIA = ["ixx_kgm2", "iyy_kgm2", "izz_kgm2", "ixy_kgm2", "ixz_kgm2", "iyz_kgm2"]
_BSIP_UNITS = {"mass_kg": "kg", "com_x_m": "m", "com_y_m": "m", "com_z_m": "m"} | dict.fromkeys(
    _INERTIA, "kg m2"
)


def _bsip_columns() -> tuple[Column, ...]:
    frame = "segment; inertia about its centre of mass"
    values = [Column(n, "float", u, "inertial parameter", frame) for n, u in _BSIP_UNITS.items()]
    spreads = [
        Column(f"{n}_sd", "float", u, "standard deviation", frame) for n, u in _BSIP_UNITS.items()
    ]
    shares = [
        Column(
            f"{_without_unit(n)}_data_share",
            "float",
            "1",
            "posterior variance reduction by the data",
        )
        for n in _BSIP_UNITS
    ]
    return (*values, *spreads, *shares)


def _spread_columns() -> tuple[Column, ...]:
    rod = "of the length of a rod with its mass and mean moment"
    return (
        Column("mass_spread_percent", "float", "%", "sd of people about the table: masses"),
        *_floats(
            "com_x_spread_percent com_y_spread_percent com_z_spread_percent",
            "%",
            f"centres of mass, {rod}; lengths' errors too",
            "segment",
        ),
        Column(
            "moments_spread_percent",
            "float",
            "%",
            "moments of inertia, the mass known",
        ),
    )


def spread_names() -> tuple[str, ...]:
    """The columns of mass, three coordinates and moments: how far people stray from the table."""
    return tuple(column.name for column in _spread_columns())


def _without_unit(name: str) -> str:
    return name.rsplit("_", 1)[0]


def column_names(kind: str) -> list[str]:
    """The columns of a kind of artifact, without families."""
    return [column.name for column in SCHEMAS[kind].columns if column.name[-1] != "*"]


def bsip_names() -> tuple[str, ...]:
    """The ten inertial columns of a segment, in the order of the table."""
    return tuple(_BSIP_UNITS)


def share_name(name: str) -> str:
    """Name of the data-share column of an inertial column."""
    return f"{_without_unit(name)}_data_share"


def _ratio(name: str, meaning: str) -> tuple[Column, ...]:
    return (
        Column(f"ratio_{name}", "float", "1", f"{meaning}, geometric mean of eight components"),
        Column(
            f"log_error_{name}",
            "float",
            "1",
            "standard error of its logarithm, widened by Student's t; nan where not known",
        ),
    )


_COMPARISON = (
    _text("table", "table of the papers it belongs to"),
    _text("variable", "what is compared"),
    _text("task", "movement, or all"),
    _text("role", "of the task: sequence (identified OM) or validation; empty if none"),
    _text("unit", "unit of the means"),
    _text("test", "name of the test; description: means without a test"),
    _text("origin", "published: as in the papers; added: what a reviewer asks for"),
    _text("method_a", "first method"),
    _text("method_b", "second method; empty if the row concerns more or fewer than two"),
    Column("n", "int", "1", "participants with all methods"),
    *_floats("mean_a sd_a mean_b sd_b difference ci_low ci_high", "as unit", "of the comparison"),
    Column("bound", "float", "as unit", "half-width of the range that counts as equivalent"),
    *_floats("statistic df1 df2 p_value", "1", "of the test; correlations: medians"),
    Column("p_holm", "float", "1", "Holm's correction over the same test's rows of the table"),
    Column("effect_size", "float", "1", "of the test"),
    _text("effect_size_name", "which effect size"),
    Column("epsilon", "float", "1", "Greenhouse and Geisser's, already in df1, df2, p_value"),
    Column("lilliefors_p", "float", "1", "normality of the differences; F tests: smallest of all"),
    *_floats(
        "count_a count_b",
        "1",
        "participants in whom the first, the second is (significantly) better",
    ),
    _text("reason", "why the test is not possible, or what to mind"),
)

_JOINT_AXIS = (
    _text("joint", "joint of the skeleton"),
    _text("axis", "where a positive moment turns the distal segment"),
)

_GAIN = (
    _text("component", "fx fy fz mx my mz cop_ap cop_ml grf_vertical"),
    _text("method", "the extended model that is compared with OM"),
    *_floats("rmse_before rmse_after", "as unit", "of OM, and of the extended model"),
    _text("unit", "N, N m or mm"),
    Column("gain_percent", "float", "%", "by how much the second is smaller; negative: larger"),
    *_floats("ci_low ci_high", "%", "95 % interval of the gain, from blocks of time"),
    _text("data", "which trials and blocks were held out"),
)

_DIAGNOSIS = (
    Column("rank", "int", "1", "order of the candidates; an effect's parameters share one"),
    _text("effect", "name in the catalogue, none or unexplained"),
    _text("target", "segment, plate's channel, joint or marker; empty where there is no choice"),
    _text("parameter", "name of the number"),
    Column("estimate", "float", "as unit", "likeliest value"),
    _text("unit", "of estimate and interval"),
    *_floats("ci_low ci_high", "as unit", "95 % interval"),
    Column("p_value", "float", "1", "1 less the probability, where no test gives another"),
    Column("gain_percent", "float", "%", "squared white residual explained on held-out data"),
    *_floats("gain_ci_low gain_ci_high", "%", "95 % interval of the gain"),
    _text("verdict", "named, ambiguous or rejected"),
    _text("class_id", "ambiguity group: members cannot be distinguished here"),
    _text("sentence", "for people"),
    _text("trials", "recordings that show it"),
    Column("probability", "float", "1", "that it is there, given what else is found"),
    _text("scope", "laboratory, person or trial: how far it reaches"),
    Column("rms_change", "float", "N or N m", "what it does to the component that it changes most"),
)

_ERROR_BUDGET = (
    _text(
        "term",
        "inertial_parameters joint_centres marker_places soft_tissue trunk_and_shoulders smoothing "
        "fault:<effect> unknown noise; total: all of RM's error",
    ),
    _text("target", "segment, joint or plate that makes it; empty: all of them together"),
    _text("component", "fx fy fz mx my mz cop_ap cop_ml; moments about the middle of the stance"),
    Column("rms", "float", "as unit", "root mean square of what the term adds"),
    _text("unit", "N, N m or mm"),
    Column("share_percent", "float", "%", "of RM's squared error: the term projected on it"),
    *_floats("share_low share_high", "%", "95 % interval of the share"),
    Column("gain_percent", "float", "%", "by which the error is smaller on data held out"),
    *_floats("gain_low gain_high", "%", "95 % interval of the gain"),
    _text("data", "what was held out; empty where the term has no gain"),
    _text("trial", "whose error it is; empty: all trials of the person together"),
    Column("scale", "float", "1", "how many times as large as usual the term is, in the mean"),
    _text("alike", "terms that these recordings hardly distinguish from it"),
)

_FAULT = (
    _text("effect", "name in the catalogue, stated_mass or inconclusive"),
    _text("target", "plate or its channel; empty: clock, vertical, stated mass"),
    _text("parameter", "name of the number"),
    _text("unit", "of the number"),
)

SCHEMAS = {
    schema.kind: schema
    for schema in (
        Schema(
            "readings",
            "participant",
            4,
            "how the numbers of a session's recordings are understood, one row per plate",
            (
                _text("session", "of the recordings; empty without sessions"),
                _text("moved", "what is in other axes: all, markers, forces or nothing (empty)"),
                Column("axis", "int", "", "of the world that was mirrored: 0 for X, 1 for Y"),
                *_floats("turned_deg turned_sd_deg", "deg", "by which it was turned instead"),
                *_floats("unsure_m", "m", "of centres of pressure by it, in 19 of 20"),
                Column("corners_only", "bool", "", "of C3D: channels were not mirrored with them"),
                _text("plate", "its name; empty if no plate was loaded"),
                Column("moment_scale", "float", "1", "what the moments are multiplied with"),
                Column("point_scale", "float", "1", "what the points of force are multiplied with"),
                _text("about", "what moments are about: stated, reversed, centred, origin, fixed"),
                *_floats("centre_x_m centre_y_m centre_z_m", "m", "the fixed point", "lab"),
                Column("turn", "int", "90 degrees", "by which the plate's axes were turned"),
                Column("reversed_round", "bool", "", "corners taken in the other direction round"),
                Column("sign", "int", "", "-1 where the file holds the action on the plate"),
                _text("place_of", "the plate with which it was exchanged"),
                _text("reversed_channel", "the one channel whose sign is the other"),
                *_floats("half_size_x_m half_size_y_m", "m", "half the widened outline", "plate"),
                _text("refusal", "why the plate was left out"),
                _text("rivals", "corrections that cannot be distinguished, separated by |"),
                _text("doubted", "what is believed as the file says all the same"),
                _text("repeats", "the plates whose copy or sum it is"),
                *(
                    column
                    for when, words in (("before", "as the file says"), ("after", "as understood"))
                    for column in (
                        *_floats(
                            f"{when}_distance_m {when}_outside_m {when}_sway_m",
                            "m",
                            f"centre of pressure {words}: beside feet, outside plate, spread",
                        ),
                        *_floats(
                            f"{when}_torque_m {when}_level_m",
                            "m",
                            f"vertical, horizontal moment at it over the force {words}",
                        ),
                        *_floats(f"{when}_lever_m", "m", f"of the force about the sensor {words}"),
                        *_floats(
                            f"{when}_level_share",
                            "1",
                            f"of the written horizontal moment, what is left {words}",
                        ),
                        *_floats(f"{when}_astray", "1", f"from leaning to the body {words}"),
                    )
                ),
            ),
        ),
        Schema(
            "markers",
            "trial",
            1,
            "marker positions, one row per frame and marker",
            (
                _TIME,
                _text("marker", "name in the marker set"),
                *_floats("x_m y_m z_m", "m", "position, NaN where missing", "world"),
                Column("filled", "bool", "", "estimated over a gap"),
            ),
        ),
        Schema(
            "wrench",
            "trial",
            1,
            "measured ground wrench on the body at the marker rate",
            (
                _TIME,
                *_WRENCH,
                _VALID,
                Column(
                    "plate*",
                    "float",
                    "N, N m, m",
                    "of one plate: force, moment about the world origin",
                    "world",
                ),
            ),
        ),
        Schema(
            "plates",
            "trial",
            1,
            "outlines of the force plates, one row per corner",
            (
                _text("plate", "name of the plate"),
                Column("corner", "int", "", "1 to 4"),
                *_floats("x_m y_m z_m", "m", "position of the corner", "world"),
            ),
        ),
        Schema(
            "contacts",
            "trial",
            1,
            "which foot stands where",
            (
                _TIME,
                Column("left_on_ground", "bool", "", "the left foot touches the ground"),
                Column("right_on_ground", "bool", "", "the right foot touches the ground"),
                Column("left_on_plate", "bool", "", "the left foot's contact is measured"),
                Column("right_on_plate", "bool", "", "the right foot's contact is measured"),
                _VALID,
            ),
        ),
        Schema(
            "quality",
            "trial",
            1,
            "what was found, corrected and excluded at ingest",
            (
                _text("check", "what was examined"),
                _text("subject", "plate, marker or segment"),
                _text("found", "what was found"),
                _text("expected", "what was expected"),
                _text("action", "what was done"),
                _text("level", "info, corrected, warning or excluded"),
            ),
        ),
        Schema(
            "skeleton",
            "participant",
            1,
            "the person's joints, one row per segment",
            (
                _SEGMENT,
                _text("parent", "segment it hangs on"),
                _text("joint", "name of the joint to the parent"),
                _text("joint_type", "free, spherical or revolute"),
                *_floats("joint_x_m joint_y_m joint_z_m", "m", "joint centre", "parent segment"),
                Column(
                    "parent_tilt_rad", "float", "rad", "tilt of the hinge about X in the parent"
                ),
                Column(
                    "child_tilt_rad", "float", "rad", "tilt of the hinge about X in the segment"
                ),
                *_floats(
                    "origin_x_m origin_y_m origin_z_m",
                    "m",
                    "segment origin from the joint",
                    "segment",
                ),
                Column("length_m", "float", "m", "length that scales the anthropometric table"),
                Column("first_guess_m", "float", "m", "the same before refinement"),
                Column("length_sd_m", "float", "m", "standard deviation after refinement"),
                Column("joint_shift_m", "float", "m", "how far refinement moved the joint"),
                Column("held", "bool", "", "no markers: the joint is held at its neutral pose"),
            ),
        ),
        Schema(
            "marker-positions",
            "participant",
            1,
            "where each marker sits on its segment",
            (
                _text("marker", "name in the marker set"),
                _SEGMENT,
                *_floats("x_m y_m z_m", "m", "position", "segment"),
                Column("weight", "float", "1", "relative weight in the inverse kinematics"),
                Column(
                    "shift_m", "float", "m", "how far refinement moved it from the static trial"
                ),
                Column("residual_m", "float", "m", "RMS residual over the refining frames"),
            ),
        ),
        Schema(
            "person",
            "participant",
            2,
            "facts of the person that later stages use",
            (
                _text("sex", "M, F or other (the mean of both tables)"),
                Column("mass_kg", "float", "kg", "mass; NaN where it is not known"),
                _text(
                    "mass_source",
                    "participants.tsv, the recording's own entry, plates, or unknown",
                ),
                Column(
                    "plate_mass_kg",
                    "float",
                    "kg",
                    "by the plates in all trials, without known loads",
                ),
                _text(
                    "mass_note", "gross disagreement of stated mass and plates, or what is missing"
                ),
                Column(
                    "height_m", "float", "m", "stature; estimated from the segments if not given"
                ),
                *_floats(
                    "anterior_x anterior_y", "1", "unit vector of the anterior direction", "world"
                ),
                _text("calibration_trial", "trial that calibrated the skeleton"),
                Column("marker_rms_m", "float", "m", "marker residual over the refining frames"),
            ),
        ),
        Schema(
            "kinematics",
            "trial",
            1,
            "joint coordinates and their derivatives",
            (
                _TIME,
                Column(
                    "determined",
                    "bool",
                    "",
                    "the markers determine this frame, and no gap or end is too near",
                ),
                Column("marker_rms_m", "float", "m", "RMS residual of the frame's markers"),
                Column("angle_sd_rad", "float", "rad", "largest standard deviation of an angle"),
                Column("cutoff_hz", "float", "Hz", "where the local smoother's gain is one half"),
                Column("q_*", "float", "m, rad, 1", "configuration (Pinocchio's order)"),
                Column("v_*", "float", "m/s, rad/s", "velocity (Pinocchio's order)"),
                Column("a_*", "float", "m/s2, rad/s2", "acceleration (Pinocchio's order)"),
                Column("sd_*", "float", "m/s2, rad/s2", "noise level of the acceleration"),
            ),
        ),
        Schema(
            "marker-residuals",
            "trial",
            1,
            "distance of each marker from its model",
            (
                _TIME,
                _text("marker", "name in the marker set"),
                Column("residual_m", "float", "m", "distance; NaN where missing"),
            ),
        ),
        Schema(
            "marker-events",
            "trial",
            2,
            "markers that jump, slip, bear another's label or sit wrong",
            (
                _text("kind", "jump, slip, swap or offset"),
                _text("marker", "name in the marker set"),
                _text("partner", "the other marker of a swap, else empty"),
                *_floats("start_s end_s", "s", "from when to when"),
                Column(
                    "size_m",
                    "float",
                    "m",
                    "how far it moved on its segment; how far a swap's markers are apart",
                ),
                Column(
                    "statistic",
                    "float",
                    "1",
                    "jump, offset: size over its spread; slip: significance in standard "
                    "deviations; swap: residual as labelled over exchanged",
                ),
                _text("sentence", "the same in words"),
                Column(
                    "put_right",
                    "bool",
                    "",
                    "a swap's labels were exchanged back for kinematics and marker-residuals",
                ),
            ),
        ),
        Schema(
            "bsip",
            "participant",
            1,
            "inertial parameters per method and segment",
            (
                _METHOD,
                _SEGMENT,
                *_bsip_columns(),
            ),
        ),
        Schema(
            "regression",
            "participant",
            2,
            "inertial parameters of the regression (RM)",
            (
                _METHOD,
                _SEGMENT,
                *_bsip_columns(),
                *_spread_columns(),
                _text("note", "what had to be repaired or assumed"),
            ),
        ),
        Schema(
            "covariance",
            "participant",
            1,
            "a root R of the parameters' covariance R R^T, per method; a row per parameter",
            (
                _METHOD,
                _SEGMENT,
                _text("parameter", "m, mcx .. Izz of the segment about its joint's centre"),
                _text("unit", "of the row's standard deviation"),
                Column("root_*", "float", "as unit", "independent contributions", "segment"),
            ),
        ),
        Schema(
            "base-parameters",
            "participant",
            1,
            "identifiable combinations of parameters, the best known first",
            (
                _text("name", "leading parameter"),
                _text("expression", "the combination in words"),
                Column("value", "float", "as unit", "least-squares estimate"),
                _text("unit", "kg, kg m or kg m2"),
                Column("sd", "float", "as unit", "standard deviation, autocorrelation counted"),
                Column("sigma_percent", "float", "%", "100 sd / |value|"),
                Column("rm_value", "float", "as unit", "the same combination of the regression"),
            ),
        ),
        Schema(
            "excitation",
            "participant",
            2,
            "how well the motion excited the parameters, and what to record next",
            (
                _text(
                    "quantity",
                    "singular_value: of the scaled base regressor; condition_number; segment: mean "
                    "share of its ten parameters that the motion could decide; combinations: of "
                    "the ten, how many the data know better than the table (0: not excited); "
                    "data_share: OM's, mean of the ten; movement: what 10 s of it would add to the "
                    "mean data share; next: the same beside the rows of next above it; "
                    "movement_forces: how much of the unknown variance of the ground forces it "
                    "would remove, in the mean of all movements",
                ),
                _text("name", "index, segment or movement"),
                Column("value", "float", "as unit", "of the quantity"),
                _text("unit", "1; % for percent points of data share and percent of variance"),
                _text("segment", "segment the row is about; of movements the one that gains most"),
                _text("text", "data share in words; what to ask the person for; else empty"),
            ),
        ),
        Schema(
            "identification",
            "participant",
            3,
            "what the identification used and reached",
            (
                _text("estimator", "name of the estimator"),
                _METHOD,
                _text("trials", "identification trials"),
                Column("samples", "int", "1", "samples per component after decimation"),
                Column("duration_s", "float", "s", "time used"),
                Column("effective_samples", "float", "1", "independent samples, all components"),
                Column("rank", "int", "1", "base parameters found"),
                Column("condition_number", "float", "1", "of the scaled base regressor"),
                Column("mass_factor", "float", "1", "sum of the masses over RM's"),
                Column("mass_factor_sd", "float", "1", "its standard deviation"),
                *_floats("rms_fx_N rms_fy_N rms_fz_N", "N", "residual of the fit"),
                *_floats(
                    "rms_mx_Nm rms_my_Nm rms_mz_Nm",
                    "N m",
                    "residual of the fit, about the middle of the motion",
                ),
                _text("note", "what a reader should mind"),
                Column(
                    "distance",
                    "float",
                    "1",
                    "squared distance from the table in sd of people; empty for RM+mass",
                ),
                Column(
                    "probability",
                    "float",
                    "1",
                    "part of people who are as far or further by such data",
                ),
                Column("rare", "bool", "", "below 1 in 100: do not use these parameters"),
                _text("farthest", "the segments that make half of the distance, in words"),
            ),
        ),
        Schema(
            "used-blocks",
            "participant",
            1,
            "intervals that identified the parameters",
            (
                _text("trial", "identification trial"),
                *_floats("start_s end_s", "s", "interval that was used"),
            ),
        ),
        Schema(
            "reconstruction",
            "trial",
            1,
            "ground wrench and COP, measured and simulated",
            (
                _TIME,
                _METHOD,
                *_WRENCH,
                Column("cop_ap_m", "float", "m", "centre of pressure, anterior", "person"),
                Column("cop_ml_m", "float", "m", "centre of pressure, to the right", "person"),
                _VALID,
                Column("used", "bool", "", "the sample helped to identify the parameters"),
            ),
        ),
        Schema(
            "fit",
            "trial",
            1,
            "how well a method's wrench follows the measured one",
            (
                _METHOD,
                _text("component", "fx fy fz mx my mz cop_ap cop_ml grf_vertical"),
                Column("rmse", "float", "as unit", "root-mean-square error"),
                _text("unit", "N, N m or mm"),
                Column("rmse_percent_bw", "float", "% body weight", "forces only"),
                *_floats("pearson_r schwer_m schwer_p schwer_c", "1", "agreement"),
                Column("n", "int", "1", "samples"),
                Column("n_effective", "float", "1", "independent samples"),
                _text("data", "held_out, or identification where no other data are left"),
            ),
        ),
        Schema(
            "overall-diagnosis",
            "participant",
            1,
            "what the simulation gets wrong in all trials of a person",
            _DIAGNOSIS,
            "diagnosis",
        ),
        Schema(
            "overall-error-budget",
            "participant",
            1,
            "what makes RM's error in all trials of a person, term by term",
            _ERROR_BUDGET,
            "error-budget",
        ),
        Schema(
            "error-budget",
            "trial",
            1,
            "what makes RM's error in this trial, term by term",
            _ERROR_BUDGET,
        ),
        Schema(
            "detection",
            "participant",
            1,
            "how small each cause might have been and still been found in these recordings",
            (
                _text("effect", "name in the catalogue"),
                _text("target", "where it would sit"),
                _text("parameter", "name of the number"),
                _text("unit", "of the limit"),
                Column(
                    "limit",
                    "float",
                    "as unit",
                    "size named in 95 of 100 recordings; inf: none",
                ),
                _text("trials", "recordings that would show it"),
            ),
        ),
        Schema(
            "diagnosis",
            "trial",
            1,
            "what the simulation gets wrong in this trial",
            _DIAGNOSIS,
        ),
        Schema(
            "extended-bsip",
            "participant",
            1,
            "inertial parameters identified again, with the named causes in the model",
            (
                _text("method", "OM+<effect>; the last contains all causes"),
                _SEGMENT,
                *_bsip_columns(),
            ),
        ),
        Schema(
            "bsip-change",
            "participant",
            1,
            "what the named causes had done to the identified parameters",
            (
                _text("method", "OM+<effect>, compared with OM"),
                _SEGMENT,
                Column("mass_change_kg", "float", "kg", "extended less OM"),
                *_floats(
                    "com_x_change_m com_y_change_m com_z_change_m",
                    "m",
                    "centre of mass, extended less OM",
                    "segment",
                ),
                Column("com_change_m", "float", "m", "length of that shift"),
                _text("largest", "mass, centre of mass or both: of all segments the most"),
                _text("sentence", "for people"),
            ),
        ),
        Schema(
            "extended-skeleton",
            "participant",
            1,
            "the torso in two parts where a second joint was named, else empty",
            (
                _text("segment", "part of the torso"),
                _text("parent", "segment or part it hangs on"),
                _text("joint", "name of the joint to the parent"),
                *_floats("joint_x_m joint_y_m joint_z_m", "m", "joint centre", "parent"),
                Column("length_m", "float", "m", "from this joint to the next"),
                Column("mass_share", "float", "1", "part of the torso's mass"),
                *_floats(
                    "flexion_share lateral_share axial_share",
                    "1",
                    "part of the waist's rotation vector about Z, X, Y that happens at this joint",
                ),
            ),
        ),
        Schema(
            "gain",
            "trial",
            1,
            "what the extended model gains in this trial on data that did not size its causes",
            _GAIN,
        ),
        Schema(
            "corrected-wrench",
            "trial",
            1,
            "ground wrench freed of the named errors of plates and clock; empty without any",
            (_TIME, *_WRENCH, _VALID),
        ),
        Schema(
            "joint-moments",
            "trial",
            1,
            "net force, moment and power at every joint, by the proximal on the distal segment",
            (
                _TIME,
                _METHOD,
                *_JOINT_AXIS,
                *_floats("force_N force_sd_N", "N", "along the axis, standard deviation", "joint"),
                *_floats("moment_Nm moment_sd_Nm", "N m", "about the axis, the same", "joint"),
                *_floats(
                    "power_W power_sd_W",
                    "W",
                    "moment times the rate of the angle about the axis; NaN where the first and "
                    "third axis nearly fall together",
                    "joint",
                ),
                Column("valid", "bool", "", "determined: else force and moment are NaN"),
            ),
        ),
        Schema(
            "joint-peaks",
            "trial",
            1,
            "largest moment at every joint, and what method and named faults change",
            (
                _METHOD,
                *_JOINT_AXIS,
                Column("peak_Nm", "float", "N m", "the moment that is largest in size"),
                Column("peak_sd_Nm", "float", "N m", "its standard deviation"),
                Column("peak_Nm_kg", "float", "N m/kg", "the same over the person's mass"),
                Column("peak_at_s", "float", "s", "when"),
                Column("frames", "int", "1", "in which the moment is determined"),
                _text("compared_with", "RM; of an extended model the one before; empty for RM"),
                Column("change_Nm", "float", "N m", "largest difference from that"),
                Column("change_rms_Nm", "float", "N m", "root mean square of the difference"),
                Column(
                    "change_percent",
                    "float",
                    "%",
                    "largest difference over the joint's largest moment about any axis",
                ),
                _text("left_out", "why frames are not determined, and how many"),
            ),
        ),
        Schema(
            "overall-gain",
            "participant",
            1,
            "what the extended model gains over all trials that the causes concern",
            _GAIN,
            "gain",
        ),
        Schema(
            "choice",
            "participant",
            1,
            "which parameters to use, over all movements (the first row) and in each",
            (
                _text("movement", "task of the trials, or all"),
                _text("use", "OM, RM+mass or RM"),
                *_ratio("om", "OM's error over RM's"),
                *_ratio("rm_mass", "RM+mass's error over RM's"),
                *_ratio("om_rm_mass", "OM's error over RM+mass's"),
                Column("trials", "int", "1", "that judge"),
                _text(
                    "data",
                    "whole_trials that OM never saw; held_out: seconds of the identification "
                    "trials, where there is no other trial; none",
                ),
                _text("sentence", "what to use and why, in words"),
            ),
        ),
        Schema(
            "correlation-difference",
            "trial",
            1,
            "test of r(RM) against r(OM)",
            (
                _text("component", "as in fit"),
                _text("method_a", "first method"),
                _text("method_b", "second method"),
                *_floats("r_a r_b r_ab n_effective", "1", "correlations and samples"),
                *_floats("williams_t df williams_p fisher_z fisher_p", "1", "of the tests"),
                _text("reason", "why a test is not possible"),
            ),
        ),
        Schema(
            "posturography",
            "trial",
            1,
            "sway measures of the centre of pressure",
            (
                _METHOD,
                *_floats("rms_ap_mm rms_ml_mm", "mm", "about the mean"),
                *_floats("rms_ap_origin_m rms_ml_origin_m", "m", "about the world origin"),
                Column("mean_velocity_mm_s", "float", "mm/s", "mean speed of the COP"),
                Column("sway_length_mm", "float", "mm", "length of the COP's path"),
                Column("ellipse_area_mm2", "float", "mm2", "95 % prediction ellipse"),
                Column("duration_s", "float", "s", "time with a COP"),
            ),
        ),
        Schema(
            "refusal",
            "trial",
            1,
            "why a stage refused its input",
            (
                _text("stage", "stage that refused"),
                _text("kind", "bad data or numerical failure"),
                _text("sentence", "what was found, what was expected, what to do"),
            ),
        ),
        Schema(
            "laboratory-information",
            "participant",
            2,
            "what a person's sessions tell of the faults of plates, clock and vertical",
            (
                _text("session", "label of the session; empty if there are none"),
                *_FAULT[:3],
                Column("standing", "bool", "1", "as trials tell it in which a person stands still"),
                _FAULT[3],
                Column("typical", "float", "as unit", "size that laboratories meet"),
                Column("most", "float", "as unit", "no fault is larger"),
                Column("known_to", "float", "as unit", "spread that no recording betters"),
                Column("trials", "int", "1", "recordings that tell of it"),
                Column("pull", "float", "1", "precision times likeliest sizes [typical]"),
                Column("precision_*", "float", "1", "with the number of this row [per typical^2]"),
            ),
        ),
        Schema(
            "laboratory",
            "cohort",
            1,
            "the faults of each laboratory by all persons together, and who deviates from it",
            (
                *_FAULT[:3],
                Column("estimate", "float", "as unit", "size if the fault is there"),
                _FAULT[3],
                *_floats("ci_low ci_high", "as unit", "95 % interval"),
                Column("probability", "float", "1", "that it is there, given what else is found"),
                _text(
                    "verdict",
                    "named; ambiguous: one of its class_id; rejected; inconclusive: no possible "
                    "size would have been named",
                ),
                Column("limit", "float", "as unit", "size that is named in 95 of 100 laboratories"),
                Column("persons", "int", "1", "whose recordings tell of it"),
                Column("trials", "int", "1", "recordings that tell of it"),
                _text("since", "first session of a change; empty: in all of the laboratory's"),
                _text("sentence", "for people"),
                _text("laboratory", "1, 2 ... by the place of the plates, that of most persons 1"),
                _text("class_id", "ambiguity group: members cannot be distinguished"),
                _text("scope", "laboratory, session or person"),
                _text("who", "session that deviates; empty: all, or all since one"),
            ),
        ),
        Schema(
            "laboratory-sums",
            "cohort",
            2,
            "what all persons together tell of each laboratory, for the diagnosis of each",
            (
                _text("laboratory", "as in laboratory"),
                *_FAULT[:3],
                Column("standing", "bool", "1", "as in laboratory-information"),
                Column("spread", "float", "1", "standard deviation between persons [typical]"),
                Column("pull", "float", "1", "precision times likeliest sizes [typical]"),
                Column("precision_*", "float", "1", "with the number of this row [per typical^2]"),
                Column("root_*", "float", "1", "root of the covariance before the data [typical]"),
            ),
        ),
        Schema(
            "values",
            "cohort",
            2,
            "one row per participant, trial, method and variable",
            (
                _text("participant", "participant_id"),
                _text("trial", "trial id, or empty"),
                _text("task", "movement, or all"),
                _text(
                    "role", "of the trial: sequence (identified OM) or validation; empty if none"
                ),
                _text("data", "held_out or identification: what the trial was to OM; else empty"),
                _text("table", "table of the papers"),
                _text("variable", "what was computed"),
                _METHOD,
                Column("value", "float", "as unit", "the value"),
                _text("unit", "unit of the value"),
            ),
        ),
        Schema(
            "load-comparison",
            "participant",
            1,
            "what a person's parameters gain by declared loads, of `bsip compare-loads`",
            (
                _text(
                    "analysis",
                    "two identifications: their difference, all segments free; loaded segments: of "
                    "both recordings together, all other segments the same",
                ),
                _text("segment", "segment of the skeleton, or all"),
                _text(
                    "quantity",
                    "m, mcx mcy mcz (first moment) and Ixx .. Izz about the segment's joint; "
                    "cx cy cz: centre of what was added, from the segment's origin; in its frame",
                ),
                _text("unit", "of the numbers"),
                *_floats("difference ci_low ci_high", "as unit", "with less without, and 95 %"),
                Column("declared", "float", "as unit", "of the declared loads"),
                Column(
                    "expected",
                    "float",
                    "as unit",
                    "what the analysis should show of the declared loads",
                ),
            ),
        ),
        Schema("comparisons", "cohort", 1, "tests between the methods", _COMPARISON),
        Schema(
            "tables-files",
            "cohort",
            1,
            "the written tables, one row per file",
            (
                _text("file", "path below the output folder"),
                _text("sha256", "of the file's bytes"),
            ),
        ),
        Schema(
            "report-files",
            "participant",
            1,
            "the written report, one row per file",
            (
                _text("file", "path below the output folder"),
                _text("sha256", "of the file's bytes"),
            ),
        ),
        Schema(
            "group-report-files",
            "cohort",
            1,
            "the cohort's report, one row per file",
            (
                _text("file", "path below the output folder"),
                _text("sha256", "of the file's bytes"),
            ),
        ),
    )
}
