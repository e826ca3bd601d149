"""What the tests of the heart share: a writer of DICOM series, and phantoms."""
