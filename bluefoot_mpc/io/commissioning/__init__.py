"""Getting servos ready: scan, set up, calibrate, test, record for identification, and the check of it all."""
