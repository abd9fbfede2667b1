"""Writes the C source of the module `incode._incode`: python3 binding.py OUT.c

What cffi has to know of the library is incode.h itself.  The module is in API
mode and keeps to the limited ABI, so that one file serves every Python 3.
"""
import pathlib
import re
import sys

import cffi


def declarations(header):
    """The header without what is for the preprocessor and for C++, and without
    what is in struct incode_callbacks, which the package does not use: cffi
    compiles no function with a pointer to constant arrays."""
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", header, flags=re.S)
    text = re.sub(r"(struct incode_callbacks) {.*?\n}", r"\1", text, flags=re.S)
    return re.sub(r"^#.*$", "", text, flags=re.M)


def main(out):
    here = pathlib.Path(__file__).resolve().parent
    ffi = cffi.FFI()
    ffi.cdef(declarations((here.parent / "incode.h").read_text()))
    ffi.cdef('extern "Python" bool incode_tick(void *, double);')
    ffi.set_source("incode._incode", "#include <incode.h>")
    ffi.emit_c_code(out)


main(sys.argv[1])
