/* A shape_main over Debian's Cyclone DDS 0.10 (C), for the cases of the OMG's interoperability suite that it can play:
 * the options and lines of ddsi-shape-main, which docs/cli.md tells.  The interface comes from CYCLONEDDS_URI.  */
#include <dds/dds.h>
#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite_shape.h"

#define MAX_TOPICS 16
#define BATCH 64

static struct {
  int publishes, subscribes, domain, best_effort, depth, deadline_ms, strength, representation, prints_written, size;
  int reads, write_period_ms, read_period_ms, time_filter_ms, lifespan_ms, iterations, instances, topics, largest_size;
  int payload_octets, by_instance, size_modulo, has_presentation, scope, is_coherent, is_ordered, has_sets;
  char durability, final_state;
  const char *topic, *color, *partition, *unsupported;
} o = {
  .depth = -1, .strength = -1, .representation = 1, .size = 20, .write_period_ms = 33, .read_period_ms = 100,
  .instances = 1, .topics = 1, .by_instance = 1, .durability = 'v',
};

static volatile sig_atomic_t ended;
static char names[MAX_TOPICS][256];
static dds_entity_t endpoints[MAX_TOPICS];

static void end(int signal)
{
  (void) signal;
  ended = 1;
}

static dds_entity_t checked(const char *what, dds_entity_t result)
{
  if (result < 0) {
    printf("failed to create %s: %s\n", what, dds_strretcode(result));
    exit(2);
  }
  return result;
}

/* --- options ------------------------------------------------------------------------------------- */

enum { WRITE_PERIOD = 256, READ_PERIOD, TIME_FILTER, LIFESPAN, ITERATIONS, INSTANCES, TOPICS, FINAL_STATE, SCOPE,
       COHERENT, ORDERED, SET_COUNT, PAYLOAD, TAKE_READ, ANNOUNCEMENT, FRAGMENT, FILTER, MODULO };

static const struct option long_options[] = {
  { "write-period", required_argument, NULL, WRITE_PERIOD },
  { "read-period", required_argument, NULL, READ_PERIOD },
  { "time-filter", required_argument, NULL, TIME_FILTER },
  { "lifespan", required_argument, NULL, LIFESPAN },
  { "num-iterations", required_argument, NULL, ITERATIONS },
  { "num-instances", required_argument, NULL, INSTANCES },
  { "num-topics", required_argument, NULL, TOPICS },
  { "final-instance-state", required_argument, NULL, FINAL_STATE },
  { "access-scope", required_argument, NULL, SCOPE },
  { "coherent", no_argument, NULL, COHERENT },
  { "ordered", no_argument, NULL, ORDERED },
  { "coherent-sample-count", required_argument, NULL, SET_COUNT },
  { "additional-payload-size", required_argument, NULL, PAYLOAD },
  { "take-read", no_argument, NULL, TAKE_READ },
  { "periodic-announcement", required_argument, NULL, ANNOUNCEMENT },
  { "datafrag-size", required_argument, NULL, FRAGMENT },
  { "cft", required_argument, NULL, FILTER },
  { "size-modulo", required_argument, NULL, MODULO },
  { NULL, 0, NULL, 0 },
};

static void set_option(int option)
{
  int number = optarg ? atoi(optarg) : 0;
  switch (option) {
  case 'P': o.publishes = 1; break;
  case 'S': o.subscribes = 1; break;
  case 'd': o.domain = number; break;
  case 'b': o.best_effort = 1; break;
  case 'r': o.best_effort = 0; break;
  case 'k': o.depth = number; break;
  case 'f': o.deadline_ms = number; break;
  case 's': o.strength = number; break;
  case 't': o.topic = optarg; break;
  case 'c': o.color = optarg; break;
  case 'p': o.partition = optarg; break;
  case 'D': o.durability = optarg[0]; break;
  case 'x': o.representation = number; break;
  case 'w': o.prints_written = 1; break;
  case 'z': o.size = number; break;
  case 'R': o.reads = 1; break;
  case 'v': break;
  case WRITE_PERIOD: o.write_period_ms = number; break;
  case READ_PERIOD: o.read_period_ms = number; break;
  case TIME_FILTER: o.time_filter_ms = number; break;
  case LIFESPAN: o.lifespan_ms = number; break;
  case ITERATIONS: o.iterations = number; break;
  case INSTANCES: o.instances = number; break;
  case TOPICS: o.topics = number < MAX_TOPICS ? number : MAX_TOPICS; break;
  case FINAL_STATE: o.final_state = optarg[0]; break;
  case SCOPE: o.has_presentation = 1, o.scope = optarg[0] == 'g' ? 2 : optarg[0] == 't'; break;
  case COHERENT: o.has_presentation = o.is_coherent = 1; break;
  case ORDERED: o.has_presentation = o.is_ordered = 1; break;
  case SET_COUNT: o.has_sets = 1; break;
  case PAYLOAD: o.payload_octets = number; break;
  case TAKE_READ: o.by_instance = 0; break;
  case ANNOUNCEMENT: break;
  case FRAGMENT: if (number) o.unsupported = "Data fragment size"; break;
  case FILTER: o.largest_size = 0; if (sscanf(optarg, " shapesize <= %d", &o.largest_size) != 1)
      o.unsupported = "Content filtered topic"; break;
  case MODULO: o.size_modulo = number; break;
  default: exit(1);
  }
}

static void parse(int argc, char **argv)
{
  int option;
  while ((option = getopt_long(argc, argv, "PSd:brk:f:s:t:c:p:D:x:wz:Rv:", long_options, NULL)) != -1)
    set_option(option);
  if (!o.topic || o.publishes == o.subscribes)
    exit(1);
  if (o.publishes && !o.color)
    o.color = "BLUE";
  /* Cyclone announces the policy and compares it; sets and order it leaves to others.  Where these are looked at, sets
   * are written, or all samples are taken at once.  */
  if (o.has_sets || (o.is_coherent && !o.by_instance))
    o.unsupported = "Presentation Coherent Access";
  if (o.is_ordered && !o.by_instance)
    o.unsupported = "Presentation Ordered Access";
}

/* --- qualities of service ------------------------------------------------------------------------ */

static dds_qos_t *endpoint_qos(void)
{
  dds_qos_t *qos = dds_create_qos();
  static const char kinds[] = "vltp"; /* in the order of dds_durability_kind_t */
  dds_data_representation_id_t id = o.representation == 2 ? DDS_DATA_REPRESENTATION_XCDR2
                                                          : DDS_DATA_REPRESENTATION_XCDR1;
  dds_history_kind_t history = o.depth == 0 ? DDS_HISTORY_KEEP_ALL : DDS_HISTORY_KEEP_LAST;
  int32_t depth = o.depth > 0 ? o.depth : 1;
  const char *kind = strchr(kinds, o.durability);
  dds_qset_reliability(qos, o.best_effort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_durability(qos, kind ? (dds_durability_kind_t) (kind - kinds) : DDS_DURABILITY_VOLATILE);
  dds_qset_data_representation(qos, 1, &id);
  dds_qset_history(qos, history, depth);
  /* What late joiners get is the durability service's; it would keep one sample of each instance.  */
  dds_qset_durability_service(qos, 0, history, depth, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED);
  dds_qset_ownership(qos, o.strength >= 0 ? DDS_OWNERSHIP_EXCLUSIVE : DDS_OWNERSHIP_SHARED);
  if (o.deadline_ms)
    dds_qset_deadline(qos, DDS_MSECS(o.deadline_ms));
  if (o.publishes) {
    if (o.strength >= 0)
      dds_qset_ownership_strength(qos, o.strength);
    if (o.lifespan_ms)
      dds_qset_lifespan(qos, DDS_MSECS(o.lifespan_ms));
    dds_qset_writer_data_lifecycle(qos, o.final_state != 'u');
  } else if (o.time_filter_ms) {
    dds_qset_time_based_filter(qos, DDS_MSECS(o.time_filter_ms));
  }
  return qos;
}

static dds_qos_t *group_qos(void)
{
  dds_qos_t *qos = dds_create_qos();
  if (o.partition)
    dds_qset_partition(qos, 1, &o.partition);
  if (o.has_presentation)
    dds_qset_presentation(qos, (dds_presentation_access_scope_kind_t) o.scope, o.is_coherent, o.is_ordered);
  return qos;
}

/* --- statuses, each a line ------------------------------------------------------------------------ */

/* Cyclone calls another partition an incompatible policy; to the specification it is nobody's mistake (DDS 1.4
 * 2.2.3.13), and the suite waits in vain for a match.  */

static const char *topic_of(dds_entity_t endpoint)
{
  for (int i = 0; i < o.topics; i++)
    if (endpoints[i] == endpoint)
      return names[i];
  return o.topic; /* a listener may be called before the endpoint is known by its number */
}

static void offered_incompatible(dds_entity_t writer, const dds_offered_incompatible_qos_status_t status, void *arg)
{
  (void) arg;
  if (status.last_policy_id != DDS_PARTITION_QOS_POLICY_ID)
    printf("on_offered_incompatible_qos() topic: '%s'  type: 'ShapeType' : %u (%u)\n", topic_of(writer),
           status.last_policy_id, status.last_policy_id);
}

static void requested_incompatible(dds_entity_t reader, const dds_requested_incompatible_qos_status_t status, void *arg)
{
  (void) arg;
  if (status.last_policy_id != DDS_PARTITION_QOS_POLICY_ID)
    printf("on_requested_incompatible_qos() topic: '%s'  type: 'ShapeType' : %u (%u)\n", topic_of(reader),
           status.last_policy_id, status.last_policy_id);
}

static void publication_matched(dds_entity_t writer, const dds_publication_matched_status_t status, void *arg)
{
  (void) arg;
  printf("on_publication_matched() topic: '%s'  type: 'ShapeType' : matched readers %u (change = %d)\n",
         topic_of(writer), status.current_count, status.current_count_change);
}

static void subscription_matched(dds_entity_t reader, const dds_subscription_matched_status_t status, void *arg)
{
  (void) arg;
  printf("on_subscription_matched() topic: '%s'  type: 'ShapeType' : matched writers %u (change = %d)\n",
         topic_of(reader), status.current_count, status.current_count_change);
}

static void offered_deadline_missed(dds_entity_t writer, const dds_offered_deadline_missed_status_t status, void *arg)
{
  (void) arg;
  printf("on_offered_deadline_missed() topic: '%s'  type: 'ShapeType' : (total = %u, change = %d)\n",
         topic_of(writer), status.total_count, status.total_count_change);
}

static void requested_deadline_missed(dds_entity_t reader, const dds_requested_deadline_missed_status_t status,
                                      void *arg)
{
  (void) arg;
  printf("on_requested_deadline_missed() topic: '%s'  type: 'ShapeType' : (total = %u, change = %d)\n",
         topic_of(reader), status.total_count, status.total_count_change);
}

static void liveliness_changed(dds_entity_t reader, const dds_liveliness_changed_status_t status, void *arg)
{
  (void) arg;
  printf("on_liveliness_changed() topic: '%s'  type: 'ShapeType' : (alive = %u, not_alive = %u)\n", topic_of(reader),
         status.alive_count, status.not_alive_count);
}

static dds_listener_t *listener(void)
{
  dds_listener_t *made = dds_create_listener(NULL);
  dds_lset_offered_incompatible_qos(made, offered_incompatible);
  dds_lset_requested_incompatible_qos(made, requested_incompatible);
  dds_lset_publication_matched(made, publication_matched);
  dds_lset_subscription_matched(made, subscription_matched);
  dds_lset_offered_deadline_missed(made, offered_deadline_missed);
  dds_lset_requested_deadline_missed(made, requested_deadline_missed);
  dds_lset_liveliness_changed(made, liveliness_changed);
  return made;
}

/* --- samples: both types are laid out alike in memory --------------------------------------------- */

static void print_sample(const char *topic, const SuiteShape *s)
{
  char payload[16] = "";
  if (s->additional_payload_size._length)
    snprintf(payload, sizeof payload, " {%u}",
             s->additional_payload_size._buffer[s->additional_payload_size._length - 1]);
  printf("%-10s %-10s %03d %03d [%d]%s\n", topic, s->color, s->x, s->y, s->shapesize, payload);
}

static void set_color(SuiteShape *s, int instance)
{
  if (instance)
    snprintf(s->color, sizeof s->color, "%s%d", o.color, instance);
  else
    snprintf(s->color, sizeof s->color, "%s", o.color);
}

/* Cyclone has no expressions, but filters its topics' readers by a function.  */
static bool passes(const void *sample, void *arg)
{
  const SuiteShape *s = sample;
  (void) arg;
  return (!o.color || strcmp(s->color, o.color) == 0) && (!o.largest_size || s->shapesize <= o.largest_size);
}

/* Bounces between 0 and the limit.  */
static void move(int32_t *position, int *velocity, int limit)
{
  *position += *velocity;
  if (*position < 0 || *position > limit) {
    *velocity = -*velocity;
    *position = *position < 0 ? 0 : limit;
  }
}

static void publish(void)
{
  SuiteShape s;
  memset(&s, 0, sizeof s);
  s.x = 50, s.y = 60, s.shapesize = o.size;
  int dx = 3, dy = 2;
  if (o.payload_octets) {
    s.additional_payload_size._length = s.additional_payload_size._maximum = (uint32_t) o.payload_octets;
    s.additional_payload_size._buffer = malloc((size_t) o.payload_octets);
    memset(s.additional_payload_size._buffer, 255, (size_t) o.payload_octets);
  }
  for (int round = 0; !ended && (!o.iterations || round < o.iterations); round++) {
    move(&s.x, &dx, 240);
    move(&s.y, &dy, 270);
    if (o.size == 0)
      s.shapesize = (o.size_modulo ? s.shapesize % o.size_modulo : s.shapesize) + 1;
    for (int t = 0; t < o.topics; t++)
      for (int i = 0; i < o.instances; i++) {
        set_color(&s, i);
        dds_return_t result = dds_write(endpoints[t], &s);
        if (result < 0)
          printf("write() failed: %s\n", dds_strretcode(result));
        else if (o.prints_written)
          print_sample(names[t], &s);
      }
    dds_sleepfor(DDS_MSECS(o.write_period_ms));
  }
  for (int t = 0; t < o.topics; t++)
    for (int i = 0; i < o.instances; i++) {
      set_color(&s, i);
      if (o.final_state == 'u')
        dds_unregister_instance(endpoints[t], &s);
      else if (o.final_state == 'd')
        dds_dispose(endpoints[t], &s);
    }
  for (int t = 0; t < o.topics && !o.best_effort; t++)
    dds_wait_for_acks(endpoints[t], DDS_SECS(1));
}

static void print_all(const char *topic, void **samples, const dds_sample_info_t *infos, int count)
{
  for (int i = 0; i < count; i++) {
    const SuiteShape *s = samples[i];
    if (infos[i].valid_data)
      print_sample(topic, s);
    if (infos[i].instance_state == DDS_IST_NOT_ALIVE_NO_WRITERS)
      printf("%-10s %-10s NOT_ALIVE_NO_WRITERS_INSTANCE_STATE\n", topic, s->color);
    else if (infos[i].instance_state == DDS_IST_NOT_ALIVE_DISPOSED)
      printf("%-10s %-10s NOT_ALIVE_DISPOSED_INSTANCE_STATE\n", topic, s->color);
  }
}

/* Cyclone hands samples out instance by instance anyway.  */
static void subscribe(void)
{
  for (int round = 0; !ended && (!o.iterations || round < o.iterations); round++) {
    for (int t = 0; t < o.topics; t++) {
      int count;
      do {
        void *samples[BATCH] = { NULL };
        dds_sample_info_t infos[BATCH];
        count = o.reads ? dds_read(endpoints[t], samples, infos, BATCH, BATCH)
                        : dds_take(endpoints[t], samples, infos, BATCH, BATCH);
        if (count > 0) {
          print_all(names[t], samples, infos, count);
          dds_return_loan(endpoints[t], samples, count);
        }
      } while (count == BATCH && !o.reads);
    }
    dds_sleepfor(DDS_MSECS(o.read_period_ms));
  }
}

int main(int argc, char **argv)
{
  setvbuf(stdout, NULL, _IOLBF, 0);
  parse(argc, argv);
  signal(SIGINT, end);
  signal(SIGTERM, end);
  dds_topic_descriptor_t descriptor = o.representation == 2 ? SuiteShape_desc : FinalSuiteShape_desc;
  descriptor.m_typename = "ShapeType";
  dds_entity_t participant =
    checked("participant", dds_create_participant((dds_domainid_t) o.domain, NULL, NULL));
  dds_entity_t topics[MAX_TOPICS];
  for (int t = 0; t < o.topics; t++) {
    snprintf(names[t], sizeof names[t], t ? "%s%d" : "%s", o.topic, t);
    printf("Create topic: %s\n", names[t]);
    topics[t] = checked("topic", dds_create_topic(participant, &descriptor, names[t], NULL, NULL));
    if (o.subscribes && (o.color || o.largest_size))
      checked("content filtered topic", dds_set_topic_filter_and_arg(topics[t], passes, NULL));
  }
  if (o.unsupported) {
    printf("%s = not supported\n", o.unsupported);
    return 2;
  }
  dds_entity_t group = o.publishes ? checked("publisher", dds_create_publisher(participant, group_qos(), NULL))
                                   : checked("subscriber", dds_create_subscriber(participant, group_qos(), NULL));
  for (int t = 0; t < o.topics; t++)
    if (o.publishes) {
      printf("Create writer for topic: %s color: %s\n", names[t], o.color);
      endpoints[t] = checked("writer", dds_create_writer(group, topics[t], endpoint_qos(), listener()));
    } else {
      printf("Create reader for topic: %s\n", names[t]);
      endpoints[t] = checked("reader", dds_create_reader(group, topics[t], endpoint_qos(), listener()));
    }
  if (o.publishes)
    publish();
  else
    subscribe();
  dds_delete(participant);
  printf("Done.\n");
  return 0;
}
