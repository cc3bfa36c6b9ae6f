# Adds one ctest case per test_*.py file of the current folder, run by the interpreter of the
# virtual environment; says so and adds none where there is no such interpreter.
#
# torch gets one thread: tests run beside each other (ctest -j), and on arrays as small as theirs
# two threads that wait for a busy core are many times slower than one. Threads of
# tests that ask for more do not spin. Python tests are the long ones, so they start first (COST).
set(SOLIDTEX_PYTHON ${PROJECT_SOURCE_DIR}/.venv/bin/python
    CACHE FILEPATH "Python with torch, for the Python tests")

function(solidtex_add_python_tests)
  cmake_path(GET CMAKE_CURRENT_SOURCE_DIR FILENAME folder)
  if(NOT EXISTS ${SOLIDTEX_PYTHON})
    message(STATUS "No Python tests in tests/${folder}: ${SOLIDTEX_PYTHON} does not exist "
                   "(test.sh makes it)")
    return()
  endif()
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/test_*.py)
  foreach(file IN LISTS files)
    cmake_path(GET file STEM name)
    add_test(NAME ${folder}.${name}
             COMMAND ${SOLIDTEX_PYTHON} -B -m pytest -q -s
                     -c ${PROJECT_SOURCE_DIR}/python_export/pyproject.toml ${file})
    set_tests_properties(${folder}.${name} PROPERTIES COST 10 ENVIRONMENT
      "SOLIDTEX_BUILD=${PROJECT_BINARY_DIR};OMP_NUM_THREADS=1;OMP_WAIT_POLICY=PASSIVE;\
ORT_DISABLE_TELEMETRY=1;PYTHONPATH=${PROJECT_SOURCE_DIR}/python_export:${PROJECT_BINARY_DIR}/python")
    if(SOLIDTEX_LONG_TESTS)
      set_property(TEST ${folder}.${name} APPEND PROPERTY ENVIRONMENT SOLIDTEX_LONG_TESTS=1)
    endif()
  endforeach()
endfunction()
