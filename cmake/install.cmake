# Headers, and what find_package(mis) needs. The library depends on nothing, so its exported target is
# the whole configuration file.
include(GNUInstallDirs)

set(package_folder ${CMAKE_INSTALL_DATADIR}/cmake/mis)
install(DIRECTORY include/mis TYPE INCLUDE)
install(TARGETS mis EXPORT mis INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT mis FILE mis-config.cmake NAMESPACE mis:: DESTINATION ${package_folder})
install(FILES ${PROJECT_BINARY_DIR}/mis-config-version.cmake DESTINATION ${package_folder})

# Not CMAKE_INSTALL_DOCDIR, which is the renderer's where a renderer installs mis: its own LICENSE is there.
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/mis)
