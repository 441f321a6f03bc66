"""What the instruments of a lab deliver, and files of it written anew where it has changed.

`c3d_file` and `trc_mot_files` bring a recording into `Instruments` and write the changed ones into
a copy. Only what changed is written; all else in a file stays as it was.
"""
