"""What the tests of training share: Tracks made by hand, and a hand that steers the twin."""
