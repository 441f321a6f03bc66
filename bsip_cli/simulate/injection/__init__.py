"""Hide effects in measured recordings.

`c3d_file` and `trc_mot_files` bring a recording into `Instruments` and write the changed
ones back into a copy; `folder` walks through a study. Only what effects changed is written;
all else in a file stays as it was.
"""
