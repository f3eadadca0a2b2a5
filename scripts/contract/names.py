"""What the bindings call the enumerations of the headers, which have no name in C."""
import re


class Enumeration:
    """prefix: of its enumerators, or the first one where they have nothing in common. zero: what C#
    adds for 0."""

    def __init__(self, prefix, python, csharp, is_flags=False, zero=None, csharp_type="uint"):
        self.prefix, self.python, self.csharp = prefix, python, csharp
        self.is_flags, self.zero, self.csharp_type = is_flags, zero, csharp_type

    def member(self, name):
        """An enumerator's name without what they have in common."""
        return name.removeprefix(self.prefix if self.prefix.endswith("_") else "DEFREC_")

    def holds(self, values):
        """Whether these enumerators are it."""
        if self.prefix.endswith("_"):
            return any(value["name"].startswith(self.prefix) for value in values)
        return values[0]["name"] == self.prefix


# The longer one of two whose prefixes begin alike comes first.
ENUMERATIONS = [
    Enumeration("DEFREC_OK", "Status", "Status", csharp_type="int"),
    Enumeration("DEFREC_LOG_", "LogLevel", "LogLevel", csharp_type="int"),
    Enumeration("DEFREC_CONTEXT_", "ContextFlag", "ContextFlags", is_flags=True, zero="None"),
    Enumeration("DEFREC_DEVICE_", "DeviceKind", "DeviceKind"),
    Enumeration("DEFREC_STAGE_", "StageKind", "StageKind"),
    Enumeration("DEFREC_FEATURE_", "DeviceFeature", "DeviceFeatures", is_flags=True, zero="None"),
    Enumeration("DEFREC_MEMORY_", "MemoryKind", "MemoryKind"),
    Enumeration("DEFREC_FORMAT_", "Format", "PixelFormat", zero="Default"),
    Enumeration("DEFREC_SCAN_", "Scan", "Scan"),
    Enumeration("DEFREC_SOLVER_", "Solver", "Solver", zero="Default"),
    Enumeration("DEFREC_SELF_CALIBRATION_", "SelfCalibration", "SelfCalibration"),
    Enumeration("DEFREC_BODY_STATE_", "BodyState", "BodyState"),
    Enumeration("DEFREC_BODY_", "BodyMode", "BodyMode"),
    Enumeration("DEFREC_REGION_", "RegionFlag", "RegionFlags", is_flags=True, zero="None"),
    Enumeration("DEFREC_FRAME_", "FrameFlag", "FrameFlags", is_flags=True, zero="None"),
    Enumeration("DEFREC_FIELD_", "Field", "FrameField"),
    Enumeration("DEFREC_INITIALISING", "State", "FrameState"),
    Enumeration("DEFREC_REASON_", "Reason", "Reasons", is_flags=True, zero="None"),
    Enumeration("DEFREC_VIEW_", "View", "Views", is_flags=True, zero="None"),
    Enumeration("DEFREC_POINT_", "PointStatus", "PointStatus", csharp_type="byte"),
    Enumeration("DEFREC_FOUND_", "Found", "Found", csharp_type="byte"),
    Enumeration(
        "DEFREC_EVIDENCE_", "Evidence", "Evidence", is_flags=True, zero="None", csharp_type="byte"
    ),
    Enumeration("DEFREC_OBSERVED", "Observation", "Observation"),
    Enumeration("DEFREC_VERDICT_", "Verdict", "Verdict"),
    Enumeration("DEFREC_DEFORMATION_", "Deformation", "Deformation"),
    Enumeration("DEFREC_FREE_", "FreeMotionKind", "FreeMotionKind"),
    Enumeration(
        "DEFREC_REGISTRATION_", "RegistrationFlag", "RegistrationFlags", is_flags=True, zero="None"
    ),
    Enumeration("DEFREC_PLAN_", "PlanFlag", "PlanFlags", is_flags=True, zero="None"),
    Enumeration("DEFREC_HAND_EYE_", "HandEyeFlag", "HandEyeFlags", is_flags=True, zero="None"),
    Enumeration("DEFREC_PREDICTED_", "PredictionBasis", "PredictionBasis", csharp_type="byte"),
]
CONSTANTS = {"DEFREC_STAGE_COUNT_V1"}  # among the enumerators of an enumeration

# What a comment calls by its name in C, in Python and in C#.
CLASSES = {
    "defrec_context_desc": ("Context", "ContextOptions"),
    "defrec_memory": ("Memory", "DeviceMemory"),
    "defrec_tracker_desc": ("Tracker", "TrackerOptions"),
    "defrec_frame": ("Tracker.submit", "Frame"),
    "defrec_disparity": ("Disparity", "Disparity"),
    "defrec_result": ("Result", "FrameResult"),
    "defrec_template_info": ("TemplateData", "Template"),
    "defrec_body_region": ("BodyRegion", "BodyRegion"),
    "defrec_registration_desc": ("Registration.from_surface", "RegistrationOptions"),
    "defrec_registration_info": ("Registration", "Registration"),
    "defrec_plan_desc": ("Plan", "Plan"),
    "defrec_plan_info": ("Plan", "Plan"),
    "defrec_plan_part": ("PlanPart", "PlanPart"),
    "defrec_registration_alternative": ("AlternativePose", "AlternativePose"),
    "defrec_free_motion": ("FreeMotion", "FreeMotion"),
    "defrec_hand_eye_desc": ("HandEye", "HandEyeOptions"),
    "defrec_hand_eye_info": ("HandEye", "HandEye"),
    "defrec_predictor_desc": ("Predictor", "Predictor"),
    "defrec_predictor_frame": ("Predictor.add_frame", "Predictor.AddFrame"),
}


def enumeration_of(values):
    """The enumeration of these enumerators; None: constants."""
    return next((each for each in ENUMERATIONS if each.holds(values)), None)


def enumeration_of_field(field):
    """The enumeration that a field's comment begins with: DEFREC_FORMAT_*, or `DEFREC_OBSERVED
    ...`; else None."""
    if field.summary.startswith("defrec_status: "):
        return ENUMERATIONS[0]
    match = re.match(r"(DEFREC_\w+_)\*|(DEFREC_\w+) \.\.\.", field.summary)
    return next((each for each in ENUMERATIONS if match and each.prefix in match.groups()), None)


def class_names(text, language):
    """Words with the classes of a language: 0 is Python, 1 is C#."""
    return re.sub(
        r"\bdefrec_\w+\b(?!\()", lambda word: CLASSES.get(word[0], (word[0],) * 2)[language], text
    )


def word_of(name, prefix, between):
    """What people read instead of an enumerator: few-matches."""
    return name.removeprefix(prefix).lower().replace("_", between)


def plural(word):
    if word.endswith("ex"):
        return word.removesuffix("ex") + "ices"
    return word + ("es" if word.endswith(("ch", "s", "x")) else "s")


def tracker_flags(contract):
    """The flags of defrec_tracker_desc, each an option of its own in the bindings: `option` is its
    name."""
    prefix = "DEFREC_TRACKER_"
    values = [
        value
        for enum in contract.enums
        for value in enum["values"]
        if value["name"].startswith(prefix)
    ]
    return [{**value, "option": value["name"].removeprefix(prefix).lower()} for value in values]


def pascal(name):
    return "".join(part[:1].upper() + part[1:].lower() for part in name.split("_"))


def camel(name):
    made = pascal(name)
    return made[0].lower() + made[1:]


def sentence(text):
    """Words as one sentence: a capital first, unless they begin with a symbol or a unit, and a full
    stop."""
    text = text.strip().rstrip(".;")
    first = re.match(r"[\w/]+", text)
    if first and first[0].islower() and first[0] not in ("px", "mm", "uu", "xx", "xyz", "w"):
        text = text[0].upper() + text[1:]
    return text + "."
