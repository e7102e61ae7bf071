# `cmake --install . --component client` installs the program amhex and its manual page; `--component client-dev`, which has to be asked
# for by name, the client library as a package for find_package(Amhex), and the protos.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Amhex)
set_target_properties(amhex_client_rpc PROPERTIES EXPORT_NAME client)
set_target_properties(amhex_client_cells PROPERTIES EXPORT_NAME client_cells)
set_target_properties(amhex_proto PROPERTIES EXPORT_NAME proto)

install(TARGETS amhex RUNTIME COMPONENT client)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/amhex.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT client)
install(TARGETS amhex_proto amhex_client_cells amhex_client_rpc EXPORT AmhexTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT client-dev EXCLUDE_FROM_ALL)
install(EXPORT AmhexTargets NAMESPACE amhex:: DESTINATION ${package_folder} COMPONENT client-dev EXCLUDE_FROM_ALL)
install(FILES
  ${PROJECT_SOURCE_DIR}/client/include/amhex/client.h
  ${PROJECT_SOURCE_DIR}/engine/include/amhex/vec3.h
  ${PROJECT_SOURCE_DIR}/engine/include/amhex/volume_mesh.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/amhex COMPONENT client-dev EXCLUDE_FROM_ALL)
install(DIRECTORY ${PROJECT_BINARY_DIR}/proto/amhex ${PROJECT_BINARY_DIR}/proto/google
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT client-dev EXCLUDE_FROM_ALL FILES_MATCHING PATTERN "*.h")
# For callers in other languages.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/proto/amhex ${PROJECT_SOURCE_DIR}/proto/google
  DESTINATION ${CMAKE_INSTALL_DATADIR}/amhex/proto COMPONENT client-dev EXCLUDE_FROM_ALL FILES_MATCHING PATTERN "*.proto")

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/AmhexConfig.cmake.in
  ${PROJECT_BINARY_DIR}/AmhexConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/AmhexConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/AmhexConfig.cmake ${PROJECT_BINARY_DIR}/AmhexConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT client-dev EXCLUDE_FROM_ALL)
