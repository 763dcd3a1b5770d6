# An image that holds the command: docker build -t meshgauge . && docker run --rm -v "$PWD:/mesh" meshgauge report part.vtu
FROM python:3.13-slim

# VTK draws with libEGL, in software, so that plots and screenshots need no display.
RUN apt-get update \
    && apt-get install -y --no-install-recommends libegl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*

COPY pyproject.toml README.md LICENSE /source/
COPY src /source/src
RUN pip install --no-cache-dir '/source[plot,view,meshioplusplus]' && rm -rf /source

# Whoever runs it owns what it writes: docker run --user "$(id -u):$(id -g)"; compiled kernels are then kept in the image's cache.
ENV NUMBA_CACHE_DIR=/var/cache/meshgauge
RUN mkdir -m 1777 /var/cache/meshgauge && useradd --create-home mesh
USER mesh
WORKDIR /mesh
ENTRYPOINT ["meshgauge"]
CMD ["--help"]
