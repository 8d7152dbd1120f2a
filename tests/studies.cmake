# The studies, with far too little time to meet their bars: they run and write everything, and refuse bad input.

# mis_test_study(NAME BAD_OPTIONS OPTIONS...): BAD_OPTIONS are --name=value, separated by commas.
function(mis_test_study study refused)
    add_test(NAME study_${study} COMMAND study_${study} ${ARGN} --output ${CMAKE_CURRENT_BINARY_DIR}/study_${study})
    add_test(NAME study_${study}_command_line
             COMMAND ${CMAKE_COMMAND} -D PROGRAM=$<TARGET_FILE:study_${study}> -D REFUSED=${refused} -P
                     ${CMAKE_CURRENT_SOURCE_DIR}/study_command_line.cmake)
    set(tested_programs ${tested_programs} study_${study} PARENT_SCOPE)
endfunction()

mis_test_study(bias --largest=0,--largest=many,--per-decade=-1,--repetitions=0,--seed=x
               --largest 10000 --per-decade 2 --repetitions 200)
mis_test_study(gaussians --passes=0,--passes=many,--seed=x --passes 1000 --report-only)
mis_test_study(low_variance --passes=0,--passes=many,--seed=x --passes 1000 --report-only)
mis_test_study(area_light --steps=1,--steps=many,--passes=0,--seed=x --steps 6 --passes 5000)
mis_test_study(splits --passes=0,--passes=many,--seed=x --passes 1000)
mis_test_study(bound --weightings=0,--weightings=many,--seed=x --weightings 200)
mis_test_study(zero_variance --walks=0,--walks=many,--longest=1,--seed=x --walks 5000 --longest 10)
mis_test_study(roulette --size=3,--seconds=0,--scene=no_such_scene,--threads=0,--seed=x
               --scene door --size 16 --seconds 0.05 --report-only)
mis_test_study(scale --size=0,--scene=no_such_scene)
mis_test_study(alpha --size=0,--passes=1,--repetitions=many,--radius=0,--seed=x
               --size 32 --passes 4 --repetitions 1 --report-only)
mis_test_study(cornell --size=0,--seconds=0,--runs=0,--reference-seconds=-1
               --size 16 --seconds 0.02 --runs 2 --reference-seconds 0.2 --report-only)
mis_test_study(media --size=0,--seconds=0,--runs=0,--radius=0,--scene=cornell,--mean-free-path=0
               --size 12 --seconds 0.02 --runs 1 --reference-seconds 0.1 --radius 0.05 --mean-free-path 1
               --report-only)
mis_test_study(optimal --largest=0,--repetitions=1,--seed=x --largest 32 --repetitions 200 --report-only)
mis_test_study(optimal_bpt --size=0,--scene=no_such_scene,--passes=0,--tile=0,--radius=2
               --scene cornell --size 16 --passes 8 --reference-seconds 0.2)
mis_test_study(direct --size=0,--samples=0,--tests=many,--cell=0,--seed=x
               --size 8 --tests 2 --cell 2 --report-only)
mis_test_study(plates --size=3,--samples=12,--samples=many,--runs=1,--reference-samples=0,--threads=0,--seed=x
               --size 16 --runs 2 --reference-samples 128 --report-only)
# Files that are no environments, and one that is.
set(environments ${CMAKE_CURRENT_BINARY_DIR}/environments)
set(heading "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n")
file(WRITE ${environments}/good.hdr "${heading}ABC~CBA~")
file(WRITE ${environments}/truncated.hdr "${heading}ABC~C")
file(WRITE ${environments}/text.exr "no picture")
mis_test_study(environment
               --map=${environments}/no_such_file.exr,--map=${environments}/truncated.hdr,--map=${environments}/text.exr,--map=${environments},--samples=12,--threads=0
               --map ${environments}/good.hdr --size 16 --runs 2 --reference-samples 128 --report-only)
mis_test_study(allocation --seeds=1,--seeds=many,--steps=0,--seed=x --seeds 3 --steps 10 --report-only)
mis_test_study(direct_allocation --size=3,--rays=0,--rays=many,--runs=1,--least-share=1,--around=-1,--threads=0,--seed=x
               --size 16 --runs 8 --report-only)
mis_test_study(bundles
               --scene=no_such_scene,--scene=spheres,--patches=0,--seconds=0,--seconds=many,--runs=1,--pilot-share=1,--seed=x
               --scene glossy_floor --size 16 --patches 300 --seconds 0.05 --runs 2 --reference-seconds 0.1
               --smooth-seconds 0.1 --report-only)
mis_test_study(probabilistic_connections
               --size=0,--scene=no_such_scene,--seconds=0,--runs=1,--runs=many,--picks=0,--even=0,--cell=2,--seed=x
               --scene cornell --size 16 --seconds 0.02 --runs 2 --reference-seconds 0.2 --report-only)
mis_test_study(metropolis
               --size=0,--scene=no_such_scene,--passes=0,--runs=1,--runs=many,--chains=0,--both=0,--seed=x
               --scene cornell --size 16 --passes 2 --runs 2 --reference-seconds 0.2 --report-only)
