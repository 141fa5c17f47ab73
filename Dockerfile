# cellmech on Debian 13: docker build -t cellmech . && docker run cellmech   (README, "In a container")
# What changes least comes first: after a change of the code only the last layers are made again.
FROM debian:trixie-slim
WORKDIR /opt/cellmech

# Debian's DOLFINx brings along what only C++ programs need. Forms are compiled in C against NumPy-sized headers and link
# the compiler's own libraries, which stay: the image is 0.7 GB smaller.
RUN printf 'path-exclude=%s\n' '/usr/include/boost/*' '/usr/lib/*.a' '/usr/libexec/valgrind/*' '/usr/share/doc/*' \
        '/usr/share/javascript/*' '/usr/share/locale/*' '/usr/share/man/*' >/etc/dpkg/dpkg.cfg.d/cellmech \
    && printf 'path-include=%s\n' '/usr/lib/gcc/*' '/usr/lib/*/libc_nonshared.a' '/usr/share/doc/*/copyright' \
        >>/etc/dpkg/dpkg.cfg.d/cellmech
COPY tools/setup.sh tools/
RUN tools/setup.sh packages && apt-get clean && rm -rf /var/lib/apt/lists/*

COPY pyproject.toml LICENSE ./
COPY cellmech/__init__.py cellmech/
RUN PIP_NO_CACHE_DIR=1 tools/setup.sh run

# Any user id works, also one without an entry in /etc/passwd: what programs write to a home goes to /tmp, compiled forms
# and fonts to a place that everybody may write to, results to /results, mounted or not.
# Open MPI: root, more ranks than cores, ranks that yield while they wait; shared memory only (no network), and no
# reading of each other's memory, which containers may forbid.
ENV PATH=/opt/cellmech/.venv/bin:$PATH \
    HOME=/tmp \
    XDG_CACHE_HOME=/opt/cellmech/.cache \
    OMP_NUM_THREADS=1 \
    OPENBLAS_NUM_THREADS=1 \
    OMPI_ALLOW_RUN_AS_ROOT=1 \
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
    OMPI_MCA_btl=self,sm \
    OMPI_MCA_smsc=^cma \
    OMPI_MCA_mpi_yield_when_idle=1 \
    PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe \
    PRTE_MCA_hwloc_default_binding_policy=none
RUN mkdir -m 1777 /results && ln -s /results results

# A coarse run and a figure leave the compiled forms of the main job in the image (they do not depend on the mesh, and are
# compiled for any processor of the architecture), the bytecode, and the proof that both work.
COPY studies studies
COPY cellmech cellmech
RUN python -m cellmech.study --out /tmp/warm --set mesh.size_um=6 time.rtol=1e-2 \
    && python -m cellmech.plots fig3 --results /tmp/warm --out /tmp/warm \
    && rm -rf /tmp/* /tmp/.[!.]* && chmod -R a+rwX .cache

COPY . .
CMD ["python", "-m", "cellmech.study"]
