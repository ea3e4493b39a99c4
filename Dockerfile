# archfem in a container, on Debian 13:
#   docker build -t archfem . && docker run --rm -v "$PWD/out:/out" archfem run ring.toml --out /out/ring
# `make test-debian13` tests the same steps; the authors have not tried the container.
FROM debian:13-slim
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends make ca-certificates \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /archfem
COPY . .
RUN make setup && .venv/bin/archfem compile && .venv/bin/archfem doctor \
    && rm -rf /var/lib/apt/lists/*
ENV PATH=/archfem/.venv/bin:$PATH OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
WORKDIR /archfem/meshes
ENTRYPOINT ["archfem"]
CMD ["--help"]
