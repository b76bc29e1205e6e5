"""The small street network: what a picture shows, without any geometry."""

from dreamdrive.knowledge.files import MARK, write_look
from dreamdrive.knowledge.look import LookOptions, Network, look
from dreamdrive.knowledge.shipped import SHIPPED, load_knowledge
