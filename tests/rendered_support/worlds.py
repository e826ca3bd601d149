"""What is rendered: boxes, cameras, lights, catheters and manoeuvres that the digital twin does not have."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Optics:
    """Both cameras. `off`: how far their place, angle (rad) and lens are from the nominal, standard deviation.

    distortion: k1 k2 p1 p2 k3; focal: the focal length over the picture's width; blur_px: the lens's own, Gaussian;
    noise: over the usual sensor noise; sharpen: of an unsharp mask; jpeg: quality, None for none.
    """

    size_px: tuple[int, int] = (1280, 720)
    focal: float = 1.06
    off: float = 0.01
    distortion: tuple[float, float, float, float, float] = (-0.12, 0.04, 0.0005, -0.0004, 0.0)
    blur_px: float = 0.55
    noise: float = 1.0
    gamma: float = 2.2
    sharpen: float = 0.0
    jpeg: int | None = None
    exposure_s: float = 0.0


@dataclass(frozen=True)
class Light:
    """The two panels, square, and what is around them.

    levels: radiance of the panel below and of the one behind; fall: what is missing at the edges' middle, share;
    wall: reflectance of inlet and far wall; ambient: radiance from everywhere else; half_mm: of a panel's size.
    """

    levels: tuple[float, float] = (1.0, 1.0)
    fall: float = 0.3
    wall: float = 0.6
    ambient: float = 0.02
    half_mm: float = 75.0


@dataclass(frozen=True)
class World:
    """One recording. `what`: in words, for the table; `tracked`: the least share of its pairs that must be tracked.

    material: of the catheter, see `materials.py`; `bands` and `rings` are coloured pieces and metal rings. end: "round"
    or "flat". debris: how many dark specks float in the box. empty: whether a picture of the empty box is given.
    """

    name: str
    what: str
    material: str = "blue"
    motion: str = "sweep"
    diameter_mm: float = 3.0
    end: str = "round"
    optics: Optics = field(default_factory=Optics)
    light: Light = field(default_factory=Light)
    debris: int = 0
    empty: bool = False
    samples: int = 4
    tracked: float = 0.97
    tip_mm: float = 0.25


WORLDS = (
    World("plain", "dark blue, straight cameras", optics=Optics(off=0.0, gamma=1.0)),
    World(
        "glossy",
        "black, glossy; uneven panels, dark walls, JPEG",
        material="black",
        optics=Optics(off=0.02, jpeg=85),
        light=Light(fall=0.8, wall=0.15),
    ),
    World(
        "vga",
        "grey; 640x480, sharpened, JPEG",
        material="grey",
        optics=Optics(size_px=(640, 480), focal=0.85, off=0.015, sharpen=0.6, jpeg=80),
    ),
    World(
        "hd",
        "dark blue; 1920x1080, a lens of strong distortion",
        optics=Optics(size_px=(1920, 1080), focal=1.0, distortion=(-0.2, 0.08, 0.001, 0.001, -0.01)),
    ),
    World(
        "dim",
        "grey; dim panels, the room half as bright, noise",
        material="grey",
        optics=Optics(noise=2.0),
        light=Light(levels=(0.35, 0.3), ambient=0.15),
    ),
    World("white", "white", material="white", optics=Optics(off=0.0), empty=True),
    World("bands", "white, red, yellow and blue, 8 mm each", material="bands", empty=True),
    World("yellow", "yellow", material="yellow", optics=Optics(off=0.02), empty=True),
    World(
        "faint",
        "white; as much light from the room as from the panels",
        "white",
        light=Light((0.5, 0.5), ambient=0.5),
        empty=True,
    ),
    World("rings", "dark blue with four metal rings and a metal end", "rings", tracked=0.6, tip_mm=0.5),
    World("flat", "black, its end cut off square", "black", end="flat", tip_mm=1.0),
    World("thin", "dark blue, 4F", diameter_mm=1.33),
    World("thick", "black, 14F", "black", diameter_mm=4.67),
    World("debris", "black; 12 dark specks of up to 2.4 mm", "black", debris=12),
    World("dark box", "black; black walls", "black", light=Light(wall=0.03, ambient=0.0), optics=Optics(off=0.02)),
    World("narrow", "dark blue; panels hardly larger than the ROI", light=Light(half_mm=62.0, wall=0.05)),
    World("fast", "dark blue; tip at up to 170 mm/s, 8 ms exposure", motion="quick", optics=Optics(exposure_s=0.008)),
    World("curl", "dark blue, curling to 270 degrees of radius 10 mm", motion="curl", tracked=0.85),
    World("camera", "black, the tip turning towards a camera", "black", motion="camera", tracked=0.9),
    World(
        "cross",
        "grey, crossing itself in one view, then the other; up to 260 mm/s",
        "grey",
        motion="cross",
        tracked=0.9,
    ),
    World("white curl", "white, curling as above", "white", motion="curl", empty=True, tracked=0.9),
    World("white cross", "white, crossing itself likewise", "white", motion="cross", empty=True, tracked=0.9),
)
