"""All readers that are tried; each module adds its own."""

from tests.mutation.binary_readers import BINARY
from tests.mutation.log_readers import LOGS
from tests.mutation.stored_readers import STORED
from tests.mutation.text_readers import TEXT

READERS = {reader.name: reader for reader in (*TEXT, *STORED, *BINARY, *LOGS)}
