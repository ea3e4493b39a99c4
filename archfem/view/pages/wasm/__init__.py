"""Compiled kernels of falling blocks as WebAssembly, for pages that simulate in a browser.

exporter  builds kernels.wasm by `make wasm`; only this needs llvmlite and ziglang
"""
