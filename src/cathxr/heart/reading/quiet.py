"""Keeps the libraries from printing what they read: their warnings quote headers, and headers name people."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import pydicom
import SimpleITK as sitk


@contextmanager
def quiet() -> Iterator[None]:
    """Silence warnings, pydicom's log and ITK's messages inside; put everything back at the end."""
    log = logging.getLogger("pydicom")
    disabled, shown = log.disabled, sitk.ProcessObject.GetGlobalWarningDisplay()
    mode = pydicom.config.settings.reading_validation_mode
    log.disabled = True
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    pydicom.config.settings.reading_validation_mode = pydicom.config.IGNORE
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.disabled = disabled
        sitk.ProcessObject.SetGlobalWarningDisplay(shown)
        pydicom.config.settings.reading_validation_mode = mode
