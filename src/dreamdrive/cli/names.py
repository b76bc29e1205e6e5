"""Options that take a name of an open table, which is looked up when the command is parsed."""

from collections.abc import Iterable

from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from dreamdrive.choices import BACKENDS, DATASETS, PRIORS


class PriorName(str):
    """Of ``PRIORS``."""


class GeometryName(str):
    """Of ``BACKENDS``."""


class DataSetName(str):
    """Of ``DATASETS``."""


_TABLES: dict[type[str], Iterable[str]] = {PriorName: PRIORS, GeometryName: BACKENDS, DataSetName: DATASETS}
REGISTRY = ConstructorRegistry()


@REGISTRY.primitive_rule
def _name_of(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[str] | None:
    kind = next((kind for kind in _TABLES if kind is info.type), None)
    if kind is None:
        return None
    names = tuple(_TABLES[kind])
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=f"{{{','.join(names)}}}",
        instance_from_str=lambda words: kind(words[0]),
        is_instance=lambda value: isinstance(value, kind),
        str_from_instance=lambda name: [name],
        choices=names,
    )
