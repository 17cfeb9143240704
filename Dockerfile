# The wheel with torch for the CPU; `make wheel` builds dist first.
#   docker build -t andabata .
#   docker run --rm -v "$PWD:/data" andabata drive --world hill
FROM python:3.11-slim

# What open3d needs of the system.
RUN apt-get update && apt-get install -y --no-install-recommends \
    libusb-1.0-0 libgl1 libegl1 libx11-6 libudev1 libidn2-0 libgomp1 \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /install
COPY constraints.txt ./
COPY dist dist
RUN pip install --no-cache-dir --constraint constraints.txt --no-deps --index-url https://download.pytorch.org/whl/cpu torch
RUN pip install --no-cache-dir --constraint constraints.txt dist/andabata-0.1.0-py3-none-any.whl

# Whoever runs it has their kernels compiled, and may write where they are.
ENV NUMBA_CACHE_DIR=/kernels
RUN andabata doctor --compile --quiet && chmod -R a+rwX /kernels

WORKDIR /data
ENTRYPOINT ["andabata"]
CMD ["--help"]
