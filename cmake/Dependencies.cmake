# Everything the project finds, each with its Debian 12 package. No other file finds anything.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)          # libeigen3-dev
find_package(TBB REQUIRED)                            # libtbb-dev
find_package(absl REQUIRED)                           # libabsl-dev

if(AMHEX_SERVICE)
  find_package(Protobuf REQUIRED)                     # libprotobuf-dev protobuf-compiler
  find_package(gRPC CONFIG REQUIRED)                  # libgrpc++-dev protobuf-compiler-grpc
  find_package(draco CONFIG REQUIRED)                 # libdraco-dev
  find_package(spdlog CONFIG REQUIRED)                # libspdlog-dev
  find_package(prometheus-cpp CONFIG REQUIRED)        # prometheus-cpp-dev
  find_package(CLI11 CONFIG REQUIRED)                 # libcli11-dev
  find_package(SQLite3 REQUIRED)                      # libsqlite3-dev
  find_package(PostgreSQL REQUIRED)                   # libpq-dev
  find_package(OpenSSL REQUIRED)                      # libssl-dev
  find_package(PNG REQUIRED)                          # libpng-dev
  find_package(ZLIB REQUIRED)                         # zlib1g-dev
  # libjs-three: the report page embeds both files.
  find_file(AMHEX_THREE_JS three.min.js PATHS /usr/share/javascript/three REQUIRED)
  find_file(AMHEX_THREE_CONTROLS_JS OrbitControls.js
    PATHS /usr/share/javascript/three/examples/js/controls REQUIRED)
endif()

if(AMHEX_TESTS)
  find_package(GTest REQUIRED)                        # libgtest-dev libgmock-dev
  find_package(benchmark REQUIRED)                    # libbenchmark-dev
endif()
