"""The limits of every door, in one table."""

MAX_FILE = 1 << 30  # of any file [bytes]
MAX_UNPACKED = 1 << 29  # of a compressed file once unpacked: an hour of a robot with thirty bodies is 320 MB [bytes]
MAX_MODEL = 1 << 25  # of a robot's model file [bytes]: the largest of the field has 2 MB
MAX_CONFIG = 1 << 22  # of profiles, mappings, contracts, metadata [bytes]: ours have 30 kB
MAX_NETWORK = 1 << 28  # of an exported network [bytes]: a general tracker has 3 MB
MAX_NAME = 200  # of a joint, body, robot, file [characters]
MAX_ELEMENTS = 20_000  # of an XML
MAX_BODIES = 2000  # of a robot: the largest humanoid has 120 with its fingers
CHILD_SECONDS = 10.0  # of a process that tries what may come to grief
CHILD_BYTES = 2 << 30  # of its memory
