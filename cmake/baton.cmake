# Build rules shared by every room of the project.

# What the sources know of the build: version and patience.
foreach(header version patience)
  configure_file(${CMAKE_SOURCE_DIR}/cmake/${header}.h.in ${CMAKE_BINARY_DIR}/generated/common/base/${header}.h @ONLY)
endforeach()

add_library(baton_options INTERFACE)
target_include_directories(baton_options INTERFACE ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}/generated)
# No value-changing float options anywhere: bytes must not depend on how a loop was compiled.
target_compile_options(baton_options INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion
  -Wnon-virtual-dtor -Woverloaded-virtual -Wold-style-cast -ffp-contract=off -fno-math-errno)
# The oldest x86 that renders (SSE4.2, 2009); the inner loops choose AVX2 or AVX-512 when the program starts. Builds with
# sanitizers have the loops once, in AVX2: GCC takes minutes for each instruction set of instrumented ones. What the others
# would add is other instructions for the same lanes (common/math/lanes-inl.h); that the best is chosen, and computes
# what the others do, is tested in all other builds.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(baton_instructions -march=x86-64-v2)
  if(BATON_SANITIZE)
    set(baton_instructions -march=x86-64-v3 -maes -mpclmul)
  endif()
  # Kernels have eight lanes everywhere: where AVX-512 copies two vectors at once that were stored one by one, the load
  # waits for both stores.
  target_compile_options(baton_options INTERFACE ${baton_instructions} -mprefer-vector-width=256)
endif()
# GCC 12 sees overlaps and overflows that are not there in its own std::string and std::vector (bug 105651 and its kin).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(baton_options INTERFACE -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread)
endif()
if(BATON_WERROR)
  target_compile_options(baton_options INTERFACE -Werror)
endif()
# Checked builds, which the tests run: containers and spans check their indices, Highway its lanes, inner loops what they
# do to padded arrays, and tests can fill work space with patterns (common/base/poison.h). Pixels are the same bytes. All
# that costs 5 to 6 % of a frame's instructions and 1 to 2 % of its time, so what people build to render goes without.
if(BATON_CHECKED)
  target_compile_definitions(baton_options INTERFACE BATON_CHECKED _GLIBCXX_ASSERTIONS HWY_IS_DEBUG_BUILD=1)
endif()
# Sanitizer builds: every finding ends the program. GCC warns of uninitialized values in sanitized code that are not.
if(BATON_SANITIZE)
  target_compile_options(baton_options INTERFACE -fsanitize=${BATON_SANITIZE} -fno-sanitize-recover=all
    -fno-omit-frame-pointer $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_compile_definitions(baton_options INTERFACE HWY_COMPILE_ONLY_STATIC)
  target_link_options(baton_options INTERFACE -fsanitize=${BATON_SANITIZE})
endif()
target_link_libraries(baton_options INTERFACE Threads::Threads)

# baton_decides_only(TARGET): it moves no pixels. Sanitizer builds compile it without optimisation, which takes less time.
function(baton_decides_only target)
  get_target_property(type ${target} TYPE)
  if(BATON_SANITIZE AND NOT BATON_FUZZ AND NOT type STREQUAL "INTERFACE_LIBRARY")
    target_compile_options(${target} PRIVATE -O0)
  endif()
endfunction()

# baton_library(NAME [FLAT] DIR folder DEPS public... PRIVATE private...): all .cpp files of one folder and, without FLAT, of
# those below; but for folders named `reader`, which are loaded (baton_image_reader).
function(baton_library name)
  cmake_parse_arguments(A "FLAT" "DIR" "DEPS;PRIVATE" ${ARGN})
  set(glob GLOB_RECURSE)
  if(A_FLAT)
    set(glob GLOB)
  endif()
  file(${glob} sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${A_DIR}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/reader/[^/]*$")
  if(sources)
    add_library(${name} STATIC ${sources})
    target_link_libraries(${name} PUBLIC baton_options ${A_DEPS} PRIVATE ${A_PRIVATE})
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE baton_options ${A_DEPS} ${A_PRIVATE})
  endif()
endfunction()

# baton_simd_kernels(FILES...): they include themselves once for each instruction set, so each is compiled by itself. Every
# vector passes through lambdas that are inlined; looking for uses of their temporaries after their scope would keep all of
# them in memory, and GCC then takes a quarter of an hour for one file.
function(baton_simd_kernels)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  if(BATON_SANITIZE)
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -fno-sanitize-address-use-after-scope)
  endif()
endfunction()

# baton_program(NAME DIR folder ROOMS folders... DEPS libraries...): the .cpp files directly in one folder, and in these of it.
function(baton_program name)
  cmake_parse_arguments(A "" "DIR" "ROOMS;DEPS" ${ARGN})
  set(patterns ${CMAKE_SOURCE_DIR}/${A_DIR}/*.cpp)
  foreach(room ${A_ROOMS})
    list(APPEND patterns ${CMAKE_SOURCE_DIR}/${A_DIR}/${room}/*.cpp)
  endforeach()
  file(GLOB sources CONFIGURE_DEPENDS ${patterns})
  if(sources)
    add_executable(${name} ${sources})
    target_link_libraries(${name} PRIVATE baton_options ${A_DEPS})
  endif()
endfunction()

# baton_image_reader(DIR folder PRIVATE libraries...): libbaton-images.so beside the programs, which load it when they read
# their first image: what it is linked with takes longer to load than most programs run.
function(baton_image_reader)
  cmake_parse_arguments(A "" "DIR" "PRIVATE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${A_DIR}/*.cpp)
  add_library(baton-images MODULE ${sources})
  target_link_libraries(baton-images PRIVATE baton_options ${A_PRIVATE})
  set_target_properties(baton-images PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${CMAKE_RUNTIME_OUTPUT_DIRECTORY})
  add_dependencies(scene baton-images)
endfunction()
