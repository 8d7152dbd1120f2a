# Exit statuses, reports and one-line errors of ${CHECK_PATHS}. Files are made in ${FOLDER}.
cmake_minimum_required(VERSION 3.21)
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})

# Checks the last call: its status, its standard output, and its standard error, "" for none. Both texts are
# regular expressions.
function(expect what expected_status expected_output expected_error)
    set(error_pattern "^$")
    if(expected_error)
        set(error_pattern "^check_paths: [^\n]*${expected_error}[^\n]*\n$")
    endif()
    if(NOT status EQUAL expected_status OR NOT output MATCHES "${expected_output}" OR NOT error MATCHES
                                                                                      "${error_pattern}")
        message(SEND_ERROR "${what}: status ${status}, standard output:\n${output}\nstandard error:\n${error}")
    endif()
endfunction()

macro(check)
    execute_process(COMMAND ${CHECK_PATHS} ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output
                    ERROR_VARIABLE error WORKING_DIRECTORY ${FOLDER})
endmacro()
macro(check_piped file)
    execute_process(COMMAND ${CMAKE_COMMAND} -E cat ${file} COMMAND ${CHECK_PATHS} ${ARGN}
                    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE error
                    WORKING_DIRECTORY ${FOLDER})
endmacro()

# Light hits of densities 1 to 20, with the weights against `claimed` next events of density 1 each; the records
# say that there are so many.
function(write_dump name claimed next_events)
    set(lines "")
    foreach(density RANGE 1 20)
        math(EXPR digits "1000000000 * ${density} / (${density} + ${claimed})")
        string(APPEND lines "{\"technique\":\"light_hit\",\"camera_vertices\":3,\"weight\":0.${digits},")
        string(APPEND lines "\"counts\":{\"light_hit\":1,\"next_event\":${next_events}},\"vertices\":[")
        string(APPEND lines "{\"kind\":\"camera\",\"density_from_camera\":1},{\"kind\":\"surface\",")
        string(APPEND lines "\"density_from_camera\":1},{\"kind\":\"light\",\"density_from_camera\":${density},")
        string(APPEND lines "\"density_from_light\":1}]}\n")
    endforeach()
    file(WRITE ${FOLDER}/${name} "${lines}")
endfunction()

write_dump(right.jsonl 1 1)
write_dump(wrong.jsonl 1 2)
file(READ ${FOLDER}/right.jsonl right)
file(WRITE ${FOLDER}/empty.jsonl "")
file(WRITE ${FOLDER}/no_records.jsonl "no record\n")
file(WRITE ${FOLDER}/cut_off.jsonl "${right}{\"technique\":\"light_hit\",")
file(ARCHIVE_CREATE OUTPUT ${FOLDER}/right.jsonl.gz PATHS ${FOLDER}/right.jsonl FORMAT raw COMPRESSION GZip)
file(SIZE ${FOLDER}/right.jsonl.gz size)
math(EXPR size "${size} - 4") # within the checksum: all records can be read
execute_process(COMMAND head -c ${size} right.jsonl.gz OUTPUT_FILE cut_off.jsonl.gz WORKING_DIRECTORY ${FOLDER})

# The whole table's last row: records, agreeing, disagreeing, undecided, unusable.
set(all_agree "\nall +20 +20 +0 +0 +0 ")
set(none_agree "\nall +20 +0 +20 +0 +0 ")

check(right.jsonl)
expect("a right dump" 0 "${all_agree}" "")
check(right.jsonl.gz)
expect("a compressed dump" 0 "${all_agree}" "")
check(wrong.jsonl)
expect("a wrong dump" 1 "${none_agree}.*\nsuspect: counts_omitted\n.* line [0-9]+: weight 0.66" "")
check(wrong.jsonl --json)
expect("a wrong dump as JSON" 1 "^{.*\"identifier\": \"counts_omitted\".*\"exit_status\": 1\n}\n$" "")
check(wrong.jsonl --examples 0)
expect("a wrong dump without examples" 1 "wrong weights, would change 0 of 0 right ones.\n  A technique" "")
check(wrong.jsonl --tolerance 0.5)
expect("a wrong dump, but tolerated" 0 "${all_agree}" "")

check_piped(right.jsonl -)
expect("a right dump through a pipe" 0 "${all_agree}" "")
check_piped(wrong.jsonl -)
expect("a wrong dump through a pipe" 1 "${none_agree}.*\nsuspect: counts_omitted\n" "")
check_piped(right.jsonl.gz -)
expect("a compressed dump through a pipe" 0 "${all_agree}" "")
check_piped(empty.jsonl -)
expect("nothing through a pipe" 2 "" "'-' has no records")

execute_process(COMMAND sh -c "sleep 0.2; head -c 500 right.jsonl; sleep 0.2; tail -c +501 right.jsonl"
                COMMAND ${RUN_WITH} --input nonblocking ${CHECK_PATHS} - RESULT_VARIABLE status OUTPUT_VARIABLE output
                ERROR_VARIABLE error WORKING_DIRECTORY ${FOLDER})
expect("a right dump through a pipe that does not block" 0 "${all_agree}" "")

# What has been read is reported, although not everything has been.
check(cut_off.jsonl)
expect("a last line that is cut off" 2 "${all_agree}.*\nlines that are no records: 1\n  line 21: not JSON" "")
check(cut_off.jsonl.gz)
expect("a compressed dump that is cut off" 2 "${all_agree}.*\nthe input could not be read to its end: "
       "'cut_off.jsonl.gz' cannot be read to its end: the compressed data is cut off")
check(cut_off.jsonl.gz --json)
expect("the same as JSON" 2 "\"records\": 20,.*\"failure\": \"the compressed data is cut off\""
       "'cut_off.jsonl.gz' cannot be read to its end: the compressed data is cut off")
check_piped(cut_off.jsonl.gz -)
expect("the same through a pipe" 2 "${all_agree}" "'-' cannot be read to its end")

check(no_such_file.jsonl)
expect("a missing file" 2 "^$" "'no_such_file.jsonl' cannot be read: No such file or directory")
check(${FOLDER})
expect("a folder" 2 "" "cannot be read: Is a directory")
check(empty.jsonl)
expect("an empty file" 2 "" "'empty.jsonl' has no records")
check_piped(empty.jsonl - --json)
expect("nothing through a pipe, as JSON" 2 "" "'-' has no records")
check(no_records.jsonl)
expect("a file without records" 2 "\nlines that are no records: 1\n" "'no_records.jsonl' has no records")

check()
expect("no file" 2 "^$" "FILE is required")
check(right.jsonl --no-such-option)
expect("an unknown option" 2 "^$" "--no-such-option")
check(right.jsonl wrong.jsonl)
expect("two files" 2 "^$" "wrong.jsonl")
foreach(tolerance -1 1 nan much)
    check(right.jsonl --tolerance ${tolerance})
    expect("tolerance ${tolerance}" 2 "^$" "--tolerance")
endforeach()
foreach(examples -1 many)
    check(right.jsonl --examples ${examples})
    expect("examples ${examples}" 2 "^$" "--examples")
endforeach()
check(--help)
expect("help" 0 "Exit status: 0 all agree" "")

if(EXISTS /dev/full)
    # As JSON, the report is larger than a buffer: what fails is not the last write.
    foreach(option "" --json --help)
        execute_process(COMMAND ${CHECK_PATHS} right.jsonl ${option} RESULT_VARIABLE status OUTPUT_FILE /dev/full
                        ERROR_VARIABLE error WORKING_DIRECTORY ${FOLDER})
        set(output "")
        expect("a report that cannot be written: ${option}" 2 "" "standard output could not all be written")
    endforeach()
endif()

# Other encodings are called by their names.
foreach(encoding UTF-16 UTF-16LE UTF-16BE UTF-32 UTF-32LE UTF-32BE)
    execute_process(COMMAND iconv -f UTF-8 -t ${encoding} right.jsonl RESULT_VARIABLE status OUTPUT_FILE wide.jsonl
                    WORKING_DIRECTORY ${FOLDER} ERROR_QUIET)
    if(NOT status EQUAL 0)
        message(STATUS "no iconv: ${encoding} is not tested")
        continue()
    endif()
    string(SUBSTRING ${encoding} 0 6 name)
    check(wide.jsonl)
    expect("${encoding}" 2 "" "'wide.jsonl' cannot be read: the text is ${name}, not UTF-8")
endforeach()

# More of gzip's files are one file; anything else behind them is not.
execute_process(COMMAND ${CMAKE_COMMAND} -E cat right.jsonl.gz right.jsonl.gz OUTPUT_FILE two.jsonl.gz
                WORKING_DIRECTORY ${FOLDER})
check(two.jsonl.gz)
expect("two compressed dumps" 0 "\nall +40 +40 +0 +0 +0 " "")
execute_process(COMMAND ${CMAKE_COMMAND} -E cat right.jsonl.gz right.jsonl OUTPUT_FILE more.jsonl.gz
                WORKING_DIRECTORY ${FOLDER})
check(more.jsonl.gz)
expect("a compressed dump with more behind it" 2 "${all_agree}"
       "'more.jsonl.gz' cannot be read to its end: something else follows the compressed data")

# Given up where nearly nothing is a record.
string(REPEAT "junk\n" 10001 junk)
file(WRITE ${FOLDER}/junk.jsonl "${right}${junk}${right}")
check(junk.jsonl)
expect("junk" 2 "${all_agree}.*\nlines that are no records: 10001\n"
       "'junk.jsonl' cannot be read to its end: given up: more than 10000 lines are no records")
check(junk.jsonl --most-malformed 10001)
expect("junk that is let pass" 2 "\nall +40 +40 .*\nlines that are no records: 10001\n" "")
check(junk.jsonl --most-malformed 0)
expect("the first junk" 2 "${all_agree}.*\nlines that are no records: 1\n" "more than 0 lines are no records")
foreach(most -1 many 1e3)
    check(right.jsonl --most-malformed ${most})
    expect("most malformed ${most}" 2 "^$" "--most-malformed")
endforeach()

# Sixty lines of nearly 16 MiB, each a path of more vertices than may be, and a line without an end: in 256 MiB. Address
# sanitizer reserves more, whatever the program does.
if(SANITIZED)
    message(STATUS "memory is not limited under address sanitizer")
    set(limited "")
else()
    set(limited ${RUN_WITH} --memory 268435456)
endif()
string(REPEAT "{\"kind\":\"surface\"}," 800000 vertices)
string(REGEX MATCH "^[^\n]*\n" line "${right}")
string(REPLACE "{\"kind\":\"surface\"" "${vertices}{\"kind\":\"surface\"" line "${line}")
file(WRITE ${FOLDER}/long.jsonl "${line}")
set(sixty "")
foreach(k RANGE 1 60)
    list(APPEND sixty long.jsonl)
endforeach()
execute_process(COMMAND ${CMAKE_COMMAND} -E cat right.jsonl ${sixty} COMMAND ${limited} ${CHECK_PATHS} -
                RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE error WORKING_DIRECTORY ${FOLDER})
expect("paths of too many vertices" 2
       "${all_agree}.*no records: 60\n  line 21: a path has at most 1000 vertices, not 800003\n" "")
execute_process(COMMAND head -c 1100000000 /dev/zero COMMAND ${limited} ${CHECK_PATHS} - RESULT_VARIABLE status
                OUTPUT_VARIABLE output ERROR_VARIABLE error)
expect("a line without an end" 2 "" "'-' cannot be read: a line is longer than 1 GiB")
