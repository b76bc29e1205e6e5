"""Messages of Foxglove's kinds on topics in an MCAP file."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dreamdrive.errors import InputError, installing
from dreamdrive.files.undisturbed import undisturbed

if TYPE_CHECKING:
    from foxglove.channel import JsonMessage, JsonSchema


def need_foxglove() -> None:
    """Raise ``InputError`` where the package of Foxglove is not installed."""
    try:
        import foxglove.channels  # noqa: F401
    except ImportError:
        raise InputError(
            f"MCAP is written by the package foxglove-sdk, which is not installed; {installing('mcap')}"
        ) from None


class McapFile:
    """A file that takes messages; all messages of a topic are of one kind.

    Signals wait until the SDK has returned: to it an interruption of ours is an error of the disk.

    Raises:
        OSError: Something could not be written; from every method, once it has happened.
    """

    def __init__(self, path: Path) -> None:
        import foxglove
        from foxglove.mcap import MCAPWriteOptions

        self._output = _Output(path)
        # Of its own, so that what else the process tells Foxglove does not come into this file.
        self._context = foxglove.Context()
        # What threads compress depends on their number.
        options = MCAPWriteOptions(compression_threads=0, disable_seeking=True)
        self._writer = foxglove.open_mcap(self._output, context=self._context, writer_options=options)
        self._channels: dict[str, Any] = {}

    @undisturbed()
    def write(self, topic: str, message: Any, time_ns: int) -> None:
        """Write a message of ``foxglove.messages``."""
        if topic not in self._channels:
            from foxglove import channels

            kind = getattr(channels, f"{type(message).__name__}Channel")
            self._channels[topic] = kind(topic, context=self._context)
        self._channels[topic].log(message, log_time=time_ns)
        self._output.check()

    @undisturbed()
    def write_json(self, topic: str, message: "JsonMessage", schema: "JsonSchema", time_ns: int) -> None:
        """Write a message as JSON, with the schema by which readers know what to plot."""
        if topic not in self._channels:
            from foxglove import Channel

            self._channels[topic] = Channel(topic, schema=schema, context=self._context)
        self._channels[topic].log(message, log_time=time_ns)
        self._output.check()

    @undisturbed()
    def write_facts(self, name: str, facts: dict[str, str]) -> None:
        """Write words about the whole file."""
        self._writer.write_metadata(name, facts)
        self._output.check()

    @undisturbed()
    def close(self) -> None:
        """Write the index of all messages and close the file."""
        try:
            self._writer.close()
        finally:
            self._output.close()
        self._output.check()


class _Output:
    """A file that remembers its first error, and then takes no more: the SDK prints errors and goes on."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("xb")
        self._error: OSError | None = None
        self._place = 0

    def write(self, data: bytes | bytearray) -> int:
        self._try(self._file.write, data)
        self._place += len(data)
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Where the file is: with ``disable_seeking`` nothing else is asked."""
        return self._place

    def flush(self) -> None:
        self._try(self._file.flush)

    def close(self) -> None:
        try:
            self._file.close()
        except OSError as error:
            self._error = self._error or error

    def check(self) -> None:
        """Raise the error that was remembered."""
        if self._error is not None:
            raise self._error

    def _try(self, act: Callable[..., object], *data: bytes | bytearray) -> None:
        if self._error is not None:
            return
        try:
            act(*data)
        except OSError as error:
            self._error = error
