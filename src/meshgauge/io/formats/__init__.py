"""The formats, one file or folder each; `meshgauge.io.registry` lists them."""
