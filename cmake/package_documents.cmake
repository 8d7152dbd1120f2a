# Run by CPack before it packs: the licence and the changelog lie where Debian has them.
set(documents "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/usr/share/doc")
file(REMOVE_RECURSE "${documents}/mis")
file(MAKE_DIRECTORY "${documents}/libmis-dev")
configure_file("${CPACK_MIS_DEBIAN}/copyright" "${documents}/libmis-dev/copyright" COPYONLY)
execute_process(COMMAND gzip -9nc "${CPACK_MIS_DEBIAN}/changelog" OUTPUT_FILE "${documents}/libmis-dev/changelog.gz"
                RESULT_VARIABLE failed)
if(failed)
    message(FATAL_ERROR "gzip of the changelog: ${failed}")
endif()
