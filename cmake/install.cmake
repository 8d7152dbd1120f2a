# Headers, and what find_package(mis) needs. The library depends on nothing, so its exported target is the
# whole configuration file.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_DATADIR}/cmake/mis)
# Below 1.0 a minor version may break what the one before it promised.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/mis-config-version.cmake
                                 COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(DIRECTORY include/mis TYPE INCLUDE)
install(TARGETS mis EXPORT mis)
install(EXPORT mis FILE mis-config.cmake NAMESPACE mis:: DESTINATION ${package_folder})
install(FILES ${PROJECT_BINARY_DIR}/mis-config-version.cmake DESTINATION ${package_folder})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
