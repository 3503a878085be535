# SPDX-License-Identifier: Apache-2.0
# Sources of the library on every machine, module by module, as data flows.
set(hpccd_sources
  src/base/forks.cpp src/base/parallel.cpp src/base/simd.cpp
  src/base/standard_arithmetic.cpp src/base/thread_affinity.cpp
  src/rigid/c_library.cpp src/rigid/joint_bounds.cpp src/rigid/joint_chain.cpp src/rigid/placed_vertices.cpp
  src/scene/edges.cpp src/scene/face_adjacency.cpp src/scene/feature_filter.cpp src/scene/features.cpp src/scene/mesh_poses.cpp src/scene/pair_rules.cpp
  src/scene/scene.cpp src/scene/separation_table.cpp src/scene/thickness.cpp
  src/scene/static_meshes.cpp src/scene/tested_pairs.cpp
  src/bvh/build.cpp src/bvh/motion_bounds.cpp src/bvh/placed_meshes.cpp src/bvh/refit.cpp src/bvh/split.cpp src/bvh/squeezed_axis.cpp
  src/detail/patches.cpp
  src/elementary/batch.cpp src/elementary/distance/distance_batch.cpp src/elementary/exact/contact.cpp
  src/elementary/exact/distance.cpp src/elementary/exact/gap_in_motion.cpp
  src/elementary/exact/intersection.cpp src/elementary/exact/separation.cpp
  src/elementary/exact/wide/approach.cpp src/elementary/exact/wide/common_roots.cpp
  src/elementary/exact/wide/earliest.cpp src/elementary/exact/wide/first_time.cpp
  src/elementary/exact/wide/isolate.cpp src/elementary/exact/wide/part.cpp src/elementary/exact/wide/root.cpp
  src/elementary/exact/wide/sign_at_root.cpp src/elementary/fallback.cpp src/elementary/intersection_batch.cpp
  src/elementary/half_space.cpp src/elementary/queries.cpp
  src/traverse/contact_search.cpp src/traverse/drift.cpp src/traverse/far_pairs.cpp src/traverse/fine_boxes.cpp
  src/traverse/leaf_edge_faces.cpp src/traverse/leaf_hulls.cpp src/traverse/leaf_pairs.cpp src/traverse/mesh_pairs.cpp
  src/traverse/less_excess.cpp src/traverse/near_corners.cpp src/traverse/nearest_pairs.cpp
  src/traverse/pair_pool.cpp src/traverse/placed_search.cpp src/traverse/snapshot_search.cpp src/traverse/worker.cpp
  src/contacts/canonical.cpp src/contacts/contours.cpp src/contacts/gaps.cpp
  src/contacts/intersection_place.cpp src/contacts/intersections.cpp
  src/contacts/order.cpp src/contacts/parts.cpp src/contacts/places.cpp src/contacts/points.cpp src/contacts/worlds.cpp
  src/solid/closed.cpp src/solid/containment.cpp src/solid/curve_order.cpp src/solid/nearest_face.cpp src/solid/outside_list.cpp
  src/solid/free_place.cpp src/solid/moved_pair.cpp src/solid/penetration.cpp src/solid/points.cpp
  src/solid/translation.cpp src/solid/winding.cpp
  src/paper/build.cpp src/paper/front.cpp src/paper/front_based.cpp src/paper/hierarchy.cpp
  src/paper/high_level.cpp src/paper/method.cpp src/paper/naive.cpp src/paper/primitive_pairs.cpp
  src/paper/published.cpp src/paper/refit.cpp src/paper/scheduling.cpp src/paper/shared_pairs.cpp
  src/paper/task_units.cpp src/paper/upkeep.cpp
  src/hybrid/communication.cpp src/hybrid/engine.cpp src/hybrid/segments.cpp src/hybrid/sink.cpp
  src/backends/available.cpp src/backends/cpu_backend.cpp src/backends/gpu_backend.cpp src/backends/gpu_distances.cpp
  src/backends/gpu_contacts.cpp src/backends/hybrid_backend.cpp src/backends/moving_tree.cpp src/backends/near_list.cpp
  src/backends/changed_pairs.cpp src/backends/one_by_one.cpp src/backends/planes.cpp src/backends/resources.cpp src/backends/rest_pairs.cpp src/backends/shortening.cpp src/backends/tuner.cpp
  src/backends/work_counts.cpp src/backends/world_by_world.cpp src/backends/worlds_on_cpus.cpp
  src/checked.cpp src/detector.cpp src/errors.cpp src/prepared.cpp src/version.cpp)
