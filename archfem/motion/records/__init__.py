"""Files of recorded ground motions, one module for each format.

    afad         format afad
    columns      format columns
    cosmos       format cosmos
    csmip        format csmip
    esm          format esm
    knet         format knet
    peer         format peer
    reader       file format detection
    record_file  text, units and channels of a record file
    smc          format smc

The format is detected from the content. Start reading at `reader`.
"""
