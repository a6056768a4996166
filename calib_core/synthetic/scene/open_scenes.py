"""Scenes with nothing that echoes within 20 m, and a road."""

from calib_core.synthetic.pairs.simulated import PairsLayout
from calib_core.synthetic.scene.scenes import Board, Box, Cylinder, Scatterer, Scene


def open_rooftop() -> Scene:
    """Build a rooftop with nothing that echoes within 20 m."""
    parapets = (
        Box(22.3, 0.0, 0.35, 60.0, 1.05, "render"),
        Box(22.3, 0.0, 0.5, 60.0, 0.07, "metal", base_m=1.05),
    )
    units = (
        Box(21.0, 7.4, 1.7, 2.4, 1.5, "louvre", base_m=0.15),
        Box(21.0, 7.4, 1.4, 2.0, 0.15, "dark"),
        Cylinder(21.4, -6.2, 0.14, 1.2, "metal"),
    )
    scatterers = (
        Scatterer(20.2, 6.3, 0.8, 6.0),
        Scatterer(21.3, -6.2, 0.7, 2.0),
        Scatterer(22.1, -0.4, 0.6, 12.0),
        Scatterer(22.1, 4.9, 0.5, 5.0),
        Scatterer(22.1, -9.2, 0.5, 5.0),
    )
    layout = PairsLayout(2.3, 16.5, 31.0, max_lateral_m=100.0, height_m=0.19, roughness_m=0.004, separation_m=0.9)
    return Scene("open-rooftop", "tiles", "city", (*parapets, *units), scatterers, layout)


def open_yard() -> Scene:
    """Build a yard with a checkerboard of plastic foam on a stand and a wall at 26 m."""
    wall = (
        Box(26.0, 0.0, 0.4, 70.0, 4.4, "brick"),
        Box(25.74, -6.9, 0.08, 1.0, 2.1, "door"),
    )
    board = (
        Box(6.56, 2.25, 0.06, 2.9, 2.0, "white", base_m=0.25),
        Box(6.52, 2.25, 0.02, 2.7, 1.8, "checkerboard", base_m=0.35),
        Cylinder(6.7, 3.45, 0.04, 2.2, "wood"),
        Cylinder(6.7, 1.05, 0.04, 2.2, "wood"),
    )
    scatterers = (Scatterer(25.8, 0.3, 1.1, 13.0), Scatterer(25.7, -6.9, 1.0, 6.0), Scatterer(25.8, 6.0, 1.0, 8.0))
    layout = PairsLayout(2.3, 16.5, 31.0, height_m=0.19, roughness_m=0.004, separation_m=0.6)
    return Scene(
        "open-yard",
        "yard",
        "city",
        (*wall, *board),
        scatterers,
        layout,
        sun_azimuth_deg=150.0,
        board=Board(6.51, 0.9, 0.35, 0.30, 8, 5),
    )


def road() -> Scene:
    """Build a road on whose middle the sensors stand."""
    lamps = tuple(Cylinder(x, side * 8.2, 0.08, 6.5, "metal") for x in (12.0, 36.0, 60.0, 84.0) for side in (1.0, -1.0))
    kerbs = tuple(Box(60.0, side * 6.6, 120.0, 0.2, 0.12, "render") for side in (1.0, -1.0))
    signs = (Cylinder(24.0, -7.4, 0.04, 1.6, "metal"), Box(24.0, -7.4, 0.03, 0.8, 0.8, "blue", base_m=1.5))
    houses = (
        Box(40.0, 18.0, 14.0, 8.0, 6.0, "plaster"),
        Box(62.0, -20.0, 16.0, 9.0, 7.0, "brick"),
        Box(95.0, 17.0, 18.0, 9.0, 6.5, "brick"),
    )
    scatterers = tuple(Scatterer(one.x_m, one.y_m, 1.0, 3.0) for one in (*lamps, signs[0]) if one.x_m < 50.0)
    layout = PairsLayout(2.3, 16.5, 31.0, max_lateral_m=5.5, height_m=0.19, roughness_m=0.004, separation_m=0.9)
    return Scene("road", "road", "trees", (*lamps, *kerbs, *signs, *houses), scatterers, layout)
