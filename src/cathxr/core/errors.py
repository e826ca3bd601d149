"""The one error tree. Every message is a sentence: what was wrong, where, and what to do."""


class CathxrError(Exception):
    """Anything that goes wrong for a reason outside this program's own logic."""


class ConfigError(CathxrError):
    """A file or option that a person wrote does not say what it must."""


class DeviceError(CathxrError):
    """A device does not do what it must."""


class DeviceNotFound(DeviceError):
    """No such device, or it cannot be opened."""


class DeviceLost(DeviceError):
    """The device was there and has gone; opening it again may bring it back."""


class CalibrationError(CathxrError):
    """A calibration cannot be made from what was given."""


class RegistrationError(CathxrError):
    """A registration cannot be made from what was given."""


class DataError(CathxrError):
    """A data file is missing, damaged, or not what it should be."""


class ProtocolError(CathxrError):
    """The other end of a link speaks something else."""


class EndOfStream(Exception):
    """A source has given all it has. Not an error."""
