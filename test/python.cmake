# The Python module and its examples; skipped by name where it is not built, or where an example wants what is not there.
set(python_examples first_run with_scipy with_jax)
if(TARGET costate_python)
  set(python_environment "PYTHONPATH=${PROJECT_BINARY_DIR}/python;COSTATE_MODELS=${PROJECT_SOURCE_DIR}/models"
                         "COSTATE_TOOL=$<TARGET_FILE:costate_app>" "PYTHONDONTWRITEBYTECODE=1")
  add_test(NAME "python:module" COMMAND Python3::Interpreter "${CMAKE_CURRENT_SOURCE_DIR}/python/module.py")
  set_tests_properties("python:module" PROPERTIES LABELS python TIMEOUT ${hang} ENVIRONMENT "${python_environment}")
  foreach(example IN LISTS python_examples)
    file(MAKE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/python/${example}")
    add_test(NAME "python:${example}"
             COMMAND Python3::Interpreter "${PROJECT_SOURCE_DIR}/apps/python/examples/${example}.py"
                     "${PROJECT_SOURCE_DIR}/models/damped_pendulum/damped_pendulum.toml"
             WORKING_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/python/${example}")
    set_tests_properties("python:${example}" PROPERTIES LABELS python TIMEOUT 300 SKIP_RETURN_CODE 77
                                                        ENVIRONMENT "${python_environment}")
  endforeach()
else()
  foreach(name module ${python_examples})
    add_test(NAME "python:${name} (not built: ${COSTATE_PYTHON_MISSING})" COMMAND ${CMAKE_COMMAND} -E true)
    set_tests_properties("python:${name} (not built: ${COSTATE_PYTHON_MISSING})" PROPERTIES DISABLED TRUE)
  endforeach()
endif()
