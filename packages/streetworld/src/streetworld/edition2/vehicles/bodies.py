"""Road users of the second edition: their bodies and the sizes that fit them.

Frame of a body: x ahead, y to the left, z up, the origin on the ground under the middle.
"""

from dreamdrive.scene.street.layout import BoxKind
from streetworld.edition2.people.bicycles import bicycle, bicycle_size
from streetworld.edition2.people.motorcycles import motorcycle, motorcycle_size
from streetworld.edition2.people.people import pedestrian, pedestrian_size
from streetworld.edition2.vehicles.buses import bus, bus_size
from streetworld.edition2.vehicles.trucks import truck, truck_size
from streetworld.edition2.vehicles.vehicles import vehicle, vehicle_size
from streetworld.engine.bodies import Part, Size
from streetworld.engine.materials import Materials


def body(kind: BoxKind, size_m: Size, look: int, materials: Materials) -> list[Part]:
    """Parts of a road user that fills its box (length, width, height); equal looks give equal bodies."""
    if kind in ("car", "van"):
        return vehicle(kind, size_m, look, materials)
    build = {
        "truck": truck,
        "bus": bus,
        "motorcycle": motorcycle,
        "bicycle": bicycle,
        "pedestrian": pedestrian,
    }
    return build[kind](size_m, look, materials)


def size_of(kind: BoxKind, look: int) -> Size:
    """Length, width and height in metres of what a look of a kind shows."""
    match kind:
        case "car" | "van":
            return vehicle_size(kind, look)
        case "truck":
            return truck_size(look)
        case "bus":
            return bus_size(look)
        case "pedestrian":
            return pedestrian_size(look)
        case "bicycle":
            return bicycle_size(look)
        case "motorcycle":
            return motorcycle_size(look)
