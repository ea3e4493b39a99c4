"""Files of recorded ground motions, one module for each family of formats.

    columns          plain columns
    keyed            named values above samples: AFAD, CWB, ESM, K-NET, PEER, UNAM
    numeric_headers  COSMOS and SMC
    reader           file format detection
    record_file      text, units and channels of a record file
    volumes          volumes 1 and 2: CSMIP/CDMG, USC, RENADIC, BHRC, GeoNet
    waveforms        miniSEED and SAC, through ObsPy

The format is detected from the content. Start reading at `reader`.
"""
