# The library itself, the scenes and the cab command.
find_package(Threads REQUIRED)
find_package(TBB REQUIRED)
find_package(fcl REQUIRED)
find_package(Qhull REQUIRED)

add_library(cab)
add_library(cab::cab ALIAS cab)
target_sources(cab PRIVATE engine/broad_phase.cpp engine/auto_strategy.cpp engine/convex_hull.cpp engine/engine.cpp engine/exact.cpp engine/frame.cpp engine/link_pairs.cpp engine/names.cpp engine/posed_set.cpp
  engine/report.cpp engine/rest_pose.cpp engine/task_runner.cpp engine/task_runner_tbb.cpp engine/traverse.cpp engine/update.cpp engine/validate.cpp)
target_sources(cab PRIVATE ${CAB_OBJECT_FILES})
target_include_directories(cab PUBLIC
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/layout/include> $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/engine/include>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_link_libraries(cab PRIVATE $<BUILD_INTERFACE:cab_flags> TBB::tbb fcl Qhull::qhull_r)
target_compile_features(cab PUBLIC cxx_std_17)
set_target_properties(cab PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})

if(CAB_BUILD_COMMAND OR CAB_BUILD_TESTS)
  find_package(assimp REQUIRED)
  file(GLOB CAB_SCENE_SOURCES CONFIGURE_DEPENDS scenes/*.cpp scenes/*/*.cpp)
  add_library(cab_scenes STATIC ${CAB_SCENE_SOURCES})
  target_link_libraries(cab_scenes PUBLIC cab PRIVATE cab_flags assimp::assimp)
endif()

if(CAB_BUILD_COMMAND)
  find_package(CLI11 REQUIRED)
  find_package(nlohmann_json REQUIRED)
  add_subdirectory(perf)
endif()
