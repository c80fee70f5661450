"""Names by which common marker sets and skeletons call the points of an arm.

Names are compared without subject, case, spaces, dots, underscores and hyphens. ``{s}`` stands for
``l``/``r`` or ``left``/``right``. Names joined by ``+`` are averaged. The alternatives of a point are
tried in their order, and so are the sets: a set fits when it has shoulder, elbow and wrist.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

SIDE_WORDS = {"left": ("l", "left"), "right": ("r", "right")}


@dataclass(frozen=True)
class MarkerSet:
    """One way of naming an arm.

    Attributes:
        name: For people.
        shoulder: Alternatives, the best first; elbow, wrist and hand_tip likewise.
        elbow: As above.
        wrist: As above.
        hand_tip: As above; may be empty.
        sided: The names tell left from right.
        skeleton: The names are those of joints, and mean something else as markers.
    """

    name: str
    shoulder: tuple[str, ...]
    elbow: tuple[str, ...]
    wrist: tuple[str, ...]
    hand_tip: tuple[str, ...]
    sided: bool = True
    skeleton: bool = False


_TIPS_OF_SKELETONS = (
    "{s}handmiddle4",
    "{s}handmiddle3",
    "{s}middle3",
    "{s}handindex3",
    "{s}fingersend",
    "{s}handmiddle1",
    "{s}handend",
    "{s}fingerbaseend",
    "{s}fingers",
)

MARKER_SETS = (
    # Skeletons (BVH). Where a skeleton has an arm, its "shoulder" is the collar bone.
    MarkerSet(
        "BVH, MotionBuilder and Mixamo",
        ("{s}arm",),
        ("{s}forearm",),
        ("{s}hand",),
        _TIPS_OF_SKELETONS,
        skeleton=True,
    ),
    MarkerSet(
        "BVH, upper and lower arm",
        ("{s}uparm", "{s}upperarm", "upperarm{s}"),
        ("{s}lowarm", "{s}lowerarm", "lowerarm{s}"),
        ("{s}hand", "hand{s}", "{s}wrist"),
        _TIPS_OF_SKELETONS,
        skeleton=True,
    ),
    MarkerSet(
        "BVH, Poser",
        ("{s}shldr",),
        ("{s}forearm",),
        ("{s}hand",),
        _TIPS_OF_SKELETONS,
        skeleton=True,
    ),
    MarkerSet(
        "BVH, ASF bones",
        ("{s}humerus",),
        ("{s}radius",),
        ("{s}wrist",),
        _TIPS_OF_SKELETONS,
        skeleton=True,
    ),
    # Markers, and bones that are called like no marker.
    MarkerSet("OptiTrack bones", ("{s}uarm",), ("{s}farm",), ("{s}hand",), ()),
    MarkerSet(
        "Plug-in Gait",
        ("{s}sho",),
        ("{s}elb+{s}elbm", "{s}elb"),
        ("{s}wra+{s}wrb", "{s}wri"),
        ("{s}fin",),
    ),
    MarkerSet(
        "Qualisys and Calibrated Anatomical Systems Technique",
        ("{s}sae", "{s}caj", "{s}ac"),
        ("{s}hle+{s}hme", "{s}hle"),
        ("{s}rsp+{s}usp",),
        ("{s}hm2+{s}hm5", "{s}hm2+{s}hl5", "{s}hm2", "{s}hm3"),
    ),
    MarkerSet(
        "Qualisys and OptiTrack animation",
        ("{s}shouldertop",),
        ("{s}elbowout+{s}elbowin", "{s}elbowout", "{s}elbow"),
        ("{s}wristout+{s}wristin", "{s}uwristout+{s}uwristin"),
        ("{s}handout+{s}handin", "{s}hand2"),
    ),
    MarkerSet(
        "Helen Hayes, OpenSim and plain names",
        ("{s}shoulder", "{s}acromium", "{s}acromion", "{s}acr"),
        ("{s}elbowlat+{s}elbowmed", "{s}lel+{s}mel", "{s}elbow", "{s}lel"),
        (
            "{s}wristlat+{s}wristmed",
            "{s}wristrad+{s}wristuln",
            "{s}faradius+{s}faulna",
            "{s}radius+{s}ulna",
            "{s}wrist",
        ),
        (
            "{s}fingersend",
            "{s}finger",
            "{s}fingertip",
            "{s}mcp3",
            "{s}handend",
            "{s}hand",
        ),
    ),
    MarkerSet(
        "anatomical landmarks",
        ("{s}gth", "acromion{s}", "{s}acromion", "{s}ac"),
        ("{s}lep+{s}mep", "lateralepicondyle{s}+medialepicondyle{s}", "{s}le+{s}me"),
        ("{s}spr+{s}spu", "radialstyloid{s}+ulnarstyloid{s}", "{s}rs+{s}us"),
        ("{s}ftp", "fingertip{s}"),
    ),
    MarkerSet(
        "anatomical landmarks of one arm",
        ("acrotip", "acromion", "gth"),
        ("epicl+epicm", "lep+mep"),
        ("stylr+stylu", "spr+spu", "rs+us"),
        ("index", "fingertip", "ftp"),
        sided=False,
    ),
    MarkerSet(
        "plain names of one arm",
        ("shoulder",),
        ("elbow",),
        ("wrist", "handright+handleft"),
        ("handtip", "fingertip", "index", "middle", "finger", "hand"),
        sided=False,
    ),
)


def plain(name: str) -> str:
    """A name as marker sets compare it: small letters and digits only."""
    return re.sub(r"[\s._\-]", "", name.lower())


BODY_HEIGHTS = {
    1.65: ("{s}fhd", "{s}bhd", "head", "headtop", "tophead", "topofhead", "{s}fronthead"),
    1.45: ("c7", "t1", "clav", "neck", "{s}sho", "{s}shoulder", "{s}ac", "{s}acr", "acrotip"),
    1.30: ("strn", "ster", "sternum", "{s}ster", "ster{s}", "chest"),
    1.15: ("t10", "xiph"),
    1.00: (
        "{s}asi",
        "{s}psi",
        "{s}asis",
        "{s}psis",
        "asis{s}",
        "psis{s}",
        "sacr",
        "hip",
        "hips",
        "pelvis",
    ),
    0.50: ("{s}kne", "{s}knee", "{s}kneelat", "latknee", "medknee"),
    0.08: ("{s}ank", "{s}ankle", "{s}anklelat", "latankle", "medankle"),
    0.04: ("{s}hee", "{s}heel", "heel", "{s}toe", "toe"),
}
"""About how high markers of the trunk, head and legs are on a person who stands [m]."""


def expanded(pattern: str) -> set[str]:
    """A pattern with all words for the sides put in."""
    words = [word for both in SIDE_WORDS.values() for word in both]
    return {pattern.replace("{s}", word) for word in words}
