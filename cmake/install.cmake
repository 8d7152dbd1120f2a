# Headers, and what find_package(mis) and pkg-config need. The library depends on nothing, so its exported target is
# the whole configuration file.
include(GNUInstallDirs)

set(package_folder ${CMAKE_INSTALL_DATADIR}/cmake/mis)
install(DIRECTORY include/mis TYPE INCLUDE)
install(TARGETS mis EXPORT mis INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT mis FILE mis-config.cmake NAMESPACE mis:: DESTINATION ${package_folder})
install(FILES ${PROJECT_BINARY_DIR}/mis-config-version.cmake DESTINATION ${package_folder})

# Not CMAKE_INSTALL_DOCDIR, which is the renderer's where a renderer installs mis: its own LICENSE is there.
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/mis)

# Paths from the file's own folder, so that the prefix can be chosen when installing, and moved later.
set(pkgconfig_folder ${CMAKE_INSTALL_DATADIR}/pkgconfig)
file(RELATIVE_PATH prefix_from_pkgconfig ${CMAKE_INSTALL_FULL_DATADIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
file(RELATIVE_PATH include_from_pkgconfig ${CMAKE_INSTALL_FULL_DATADIR}/pkgconfig ${CMAKE_INSTALL_FULL_INCLUDEDIR})
configure_file(cmake/mis.pc.in ${PROJECT_BINARY_DIR}/mis.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/mis.pc DESTINATION ${pkgconfig_folder})

if(MIS_is_top_level)
    include(cmake/package.cmake)
endif()

# A renderer that installs mis has an uninstall of its own, or none.
if(MIS_is_top_level)
    add_custom_target(uninstall COMMAND ${CMAKE_COMMAND} -D MANIFEST=${PROJECT_BINARY_DIR}/install_manifest.txt -P
                                        ${PROJECT_SOURCE_DIR}/cmake/uninstall.cmake VERBATIM)
endif()
