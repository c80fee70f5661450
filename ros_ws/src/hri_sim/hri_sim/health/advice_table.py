"""The table of what to do about each thing that can be wrong, special ones before general ones."""

from __future__ import annotations

from dataclasses import dataclass

SILENT, GONE, UNHEARD, ABSENT, FROZEN = "silent", "gone", "unheard", "absent", "frozen"
TWINS, SOURCES = "twins", "two sources"
SLOW, MISSES, STARVED, DROPS, COMPILED = "slow", "misses", "starved", "drops", "compiled"
QUIET = "quiet"
"""Keys of what nodes do not say themselves: it is seen from their figures, their silence, or the graph."""


@dataclass(frozen=True)
class Advice:
    """One advice.

    Attributes:
        do: What to do.
        keys: Keys of faults that it is for; one that ends in a space is for all that begin so.
        words: Regular expression that is looked for in what is said; empty: the keys alone count.
    """

    do: str
    keys: tuple[str, ...] = ()
    words: str = ""

    def is_for(self, key: str) -> bool:
        """Whether it is for a key."""
        return any(key == own or (own.endswith(" ") and key.startswith(own)) for own in self.keys)


TABLE = (
    # ---------------------------------------------------------------- how the robot is moved
    Advice(
        "Stop the robot and see that the person is free. Then look at the bag of the run for why: late "
        "samples, late plans, a controller that did not stop (scripts/draw_run.py).",
        words=r"touches a person",
    ),
    Advice(
        "Nobody sends /separation/speed_scale: start what moves the robot (hri_planner ptomp or policy) "
        "or the separation monitor; if it runs, its own row says why it is silent.",
        words=r"heartbeat of the speed scale",
    ),
    Advice(
        "Start the separation monitor again; or, to do without one, end this node and start it anew.",
        words=r"separation monitor that this node left the speed scale to has ended",
    ),
    Advice(
        "Whoever sends /separation/speed_scale keeps the robot at rest: its row says for what, mostly a "
        "missing input or a person who is near.",
        words=r"speed scale is 0",
    ),
    Advice(
        "The planner does not send its plans in time: see its row; if that is late or was not run, give "
        "the machine less to do.",
        words=r"new plan that the motion needs|the replan is .* late",
    ),
    Advice(
        "Two nodes command the robot's speed: end the other one, or start it with heartbeat:=false. A "
        "planner or policy of this project lets go by itself when it sees a monitor.",
        words=r"should this monitor hang",
    ),
    # ---------------------------------------------------------------- motion capture
    Advice(
        "The source of the arm sends NaN or infinity as if it saw the point: let it say valid = false for "
        "what it does not see.",
        words=r"said to be valid, and is not finite",
    ),
    Advice(
        "Their source goes on sending their arms, and has taken them off its list: let it list everybody "
        "whom it sends.",
        words=r"still seen, but no longer listed",
    ),
    # ---------------------------------------------------------------- two people
    Advice(
        "Track a second person, or wait for them: the interaction monitor watches two bodies. If it is to "
        "watch others than those that are tracked, see its parameter pair.",
        words=r"an interaction needs two|(is|are) not tracked",
    ),
    Advice(
        "If others are meant, start the interaction monitor with -p pair:=\"['ONE','OTHER']\".",
        words=r"set pair to watch others",
    ),
    Advice(
        "That arm is not tracked. If the other one is to be watched, start the interaction monitor with "
        "-p side:=left (or right).",
        words=r"no (left|right) arm of",
    ),
    # ---------------------------------------------------------------- clocks
    Advice(
        "The clocks differ: let all machines follow one time server (chrony), give all nodes the same "
        "use_sim_time, and check the unit of the source's stamps.",
        words=r"in the future|ahead of the clock",
    ),
    Advice(
        "The clock jumped, or the node stood still: stopped, or on a machine with too much to do. Do not "
        "set clocks while a graph runs: chrony slews them. After a simulated clock that "
        "began anew start the other nodes anew as well, and see that only one node publishes /clock.",
        keys=("clock", "slip"),
        words=r"the clock (went|ran)",
    ),
    # ---------------------------------------------------------------- people
    Advice(
        "The predictor's row says what is wrong with the samples of that person.",
        words=r"the prediction of .* is invalid",
    ),
    Advice(
        "Start the predictor (scripts/run_node.py hri_prediction predictor); if it runs, compare its "
        "namespace, and see that the same bodies are tracked.",
        words=r"no prediction of .* yet",
    ),
    Advice(
        "What said who is tracked has died or hangs: see its row, and start it again. Sources say it every "
        "40 ms; one of your own must, too, an empty list as well.",
        words=r"nothing says any longer who is tracked",
    ),
    Advice(
        "One of several sources of people has died or hangs: see its row, and start it again. If it is not "
        "to come back, start the separation monitor, and what moves the robot, anew without it. A source "
        "of your own is to say its list every 40 ms, with the stamp of when it became so.",
        words=r"a source no longer says who is tracked",
    ),
    Advice(
        "Something says a new list of people every few milliseconds: let it stamp each with when the list "
        "became so, and not with when it is said.",
        words=r"lists at a time say who is tracked",
    ),
    Advice(
        "Capture lost somebody who was near the robot, and no longer lists them. See that they are away; "
        "the robot goes on when they are listed and seen again, or the separation monitor is started anew.",
        words=r"was lost beside the robot",
    ),
    Advice(
        "The robot's driver says speeds that its angles contradict: zeros, another unit, or those of "
        "another joint. Mend the driver; joint_speed_error of the separation monitor says by how much they "
        "may differ.",
        words=r"contradicts its angle",
    ),
    Advice(
        "Two nodes publish /joint_states, such as a driver and a simulator: end one of them.",
        words=r"/joint_states come from two sources",
    ),
    Advice(
        "The separation monitor did not get a processor in time: give the machine less to do, or permit "
        "real-time priority (docs/architecture.md).",
        keys=("held_up",),
    ),
    Advice(
        "The predictor says that an arm is elsewhere than it is seen, mostly because the arm has jumped or "
        "moved as nobody does. If it stays so: does a second predictor speak, or is it fed by another "
        "source than the separation monitor?",
        keys=("disbelieved",),
    ),
    Advice(
        "The protective distance is too small for such paths: slow them down, or let the monitor reckon "
        "with them (its robot_speed and robot_acceleration).",
        keys=("robot_speed", "robot_acceleration"),
    ),
    Advice(
        "Start a source of people: scripts/run_node.py hri_sim person, scripts/replay_mocap.py FILE, or "
        "hri_prediction mocap_live. One that runs already is perhaps in another ROS domain or namespace.",
        words=r"who is tracked|nothing heard of people|no body is tracked|no arm of .* yet",
    ),
    Advice(
        "That person is tracked, and no arm has come: the camera's view is covered, the markers are named "
        "otherwise, or the source is in another namespace. echo_topic.py /humans/bodies/<id>/arm shows "
        "what comes.",
        words=r"not seen yet",
    ),
    Advice(
        "The arm's lengths are impossible. Mostly: a wrong unit (metres are wanted), or shoulder, elbow "
        "or wrist mapped to other markers. See map and unit of the source.",
        words=r"implausible length|(arm|hand) (of .* )?is .* m long",
    ),
    Advice(
        "Samples come twice, or out of order: mostly two sources of one body at once, such as person and "
        "replay_mocap.py. End one of them.",
        words=r"late or repeated sample|side changed|stamps went back",
    ),
    Advice(
        "Markers are taken for each other, or jump: look at the labels in the motion capture program, for "
        "reflections, and that only one source sends this body.",
        keys=("samples ", "wrist "),
        words=r"markers swapped|markers seemed swapped|\(jump|jump of a marker|: jump: ",
    ),
    Advice(
        "Motion capture sends too few samples a second: raise its rate (see parameter rate), or the "
        "machine does not keep up.",
        words=r"too seldom to find reaches",
    ),
    Advice(
        "No usable samples of that person: covered from the cameras or out of their volume, or the source "
        "has ended, as a recording does: start it again. The robot stays at rest until the arm is seen.",
        keys=("invalid ",),
        words=r"no usable sample|arm not seen|\binvalid: |was last seen [\d.]+ s ago",
    ),
    Advice(
        "Samples come too late: see the rows of the source and of the predictor (rate, age, latency), and "
        "how busy the machine and the network are.",
        words=r"newest sample behind",
    ),
    Advice(
        "A message about a person cannot be used: the text says what is wrong with it, docs/messages.md "
        "how it should be (frame world, side left or right, each body on the topic of its own).",
        keys=("arm", "body", "prediction", "hand"),
    ),
    Advice(
        "Give bodies names of letters, digits and underscores, or raise max_bodies of the predictor.",
        keys=("bodies",),
    ),
    Advice(
        "The predictor cannot learn this person, and goes on with what it knows. See that "
        "target_positions, facing and tracking are in the same axes, and that people_folder can be "
        "written to; scripts/people.py lists damaged folders and deletes them. When its process has "
        "ended, start the predictor anew.",
        keys=("hybrid ",),
    ),
    Advice(
        "The separation monitor has not had what it decides by: /joint_states, the controller's reference, "
        "and who is tracked. See the rows of these.",
        words=r"has not decided yet",
    ),
    # ---------------------------------------------------------------- the robot
    Advice(
        "Start the simulator (scripts/run_node.py hri_sim simulator) or the robot's driver; if it runs, "
        "compare namespace, ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE.",
        words=r"no /joint_states yet|nothing heard of the robot",
    ),
    Advice(
        "What sends /joint_states, or the controller's reference, has died, hangs or is late: see its row, "
        "or the robot's driver.",
        words=r"/joint_states are|controller's reference is",
    ),
    Advice(
        "The robot's messages cannot be used: the driver must name all seven joints, with finite numbers.",
        keys=("joints", "reference"),
    ),
    # ---------------------------------------------------------------- planning and control
    Advice(
        "The plan was refused. Now and then that is a late one on a busy machine, or one made for full "
        "speed while the separation monitor slows the robot; if it goes on at full speed, planner and "
        "controller disagree about time, joints or limits: compare clocks and robot.",
        keys=("trajectory",),
    ),
    Advice("Send /separation/speed_scale as a number from 0 to 1.", keys=("speed_scale",)),
    Advice(
        "The robot waits for what is named, and goes on by itself once that is back. If it comes from a "
        "node in this table, that row says more.",
        keys=("paused",),
    ),
    Advice(
        "Planning fails. If the text names the goal, choose another one; otherwise keep the planner's log "
        "and bag, and report it.",
        keys=("replan",),
    ),
    Advice(
        "Send goals on /policy/goal only during a motion (begin one by /policy/reach_target), in the frame "
        "world, with present stamps.",
        keys=("goal",),
    ),
    # ---------------------------------------------------------------- experiments
    Advice(
        "Start the adaptation node with the same experiment: scripts/adapt_policy.py starts all.",
        words=r"nothing heard of the adaptation node",
    ),
    Advice(
        "Start the policy node (scripts/run_node.py hri_planner policy).",
        words=r"policy/\w+ is not there|did not answer within",
    ),
    Advice("Ask the person to rest the hands beside the targets.", words=r"a hand (is at|moves)"),
    Advice(
        "Guesses count from the robot's start until the trial is over, and name a goal of the experiment.",
        keys=("guess",),
    ),
    Advice(
        "A trial was broken off and is made again. If that goes on, see why in the text and in the policy "
        "node's row.",
        keys=("trial",),
    ),
    Advice(
        "Mend what is named, then start scripts/adapt_policy.py with the same --out: it goes on from the "
        "last whole trial.",
        keys=("stopped",),
    ),
    Advice(
        "Name a target that this person has, with times in range: the scenario file lists the targets.",
        keys=("cue",),
    ),
    # ---------------------------------------------------------------- motion capture
    Advice(
        "See that Qualisys Track Manager runs, captures or replays with real-time output on, and that "
        "host, port and firewall let this machine through. The node tries again by itself.",
        keys=("stream",),
        words=r"\bQTM\b",
    ),
    Advice(
        "The markers do not make an arm: label them in Track Manager, or name them with the parameter maps "
        "(docs/recordings.md).",
        keys=("markers",),
    ),
    # ---------------------------------------------------------------- recording
    Advice(
        "Free disk space or record elsewhere, then start the recorder anew. What was written so far can be "
        "kept: scripts/inspect_bag.py BAG --salvage OUT.",
        keys=("disk",),
        words=r"not writing|[Nn]o space left|disk is full",
    ),
    Advice(
        "The recorder does not keep up: record to a faster disk, leave topics out (parameter exclude), or "
        "give the machine less to do. What was dropped is missing in the bag.",
        words=r"queue was full|(^|; )behind: ",
    ),
    Advice(
        "Messages were lost before they reached the recorder: the machine or the network is too busy. "
        "scripts/inspect_bag.py shows the gaps.",
        words=r"lost in transport",
    ),
    Advice(
        "Install or source the package of that message type, and give a topic one type only.",
        words=r"is not recorded|is published with types|topics of unknown types",
    ),
    # ---------------------------------------------------------------- the machine
    Advice(
        "The machine did not run this node for a while: close what else computes (see top), switch off "
        "power saving and suspend, give the graph cores of its own.",
        keys=("standstill",),
        words=r"was not run for",
    ),
    Advice(
        "This node was held up: the machine is too busy (see top). Captures that were skipped are missing.",
        keys=("late",),
    ),
    Advice(
        "The machine is too slow or too busy for this node: close what else computes (see top), or let "
        "another machine run some of the nodes.",
        keys=(SLOW, STARVED),
    ),
    Advice(
        "Replans come late: close what else computes (see top), or give the planner less to do: a longer "
        "replan_interval, smaller planner.num_rollouts and planner.num_timesteps.",
        keys=(MISSES,),
    ),
    Advice(
        "More messages come between two ticks than are kept: this node is held up (see top), or a source "
        "sends much more often than foreseen.",
        keys=(DROPS,),
    ),
    Advice(
        "Kernels were compiled while the graph waited, which is slow once: start the graph again.",
        keys=(COMPILED,),
    ),
    # ---------------------------------------------------------------- nodes and the graph
    Advice(
        "The separation monitor does not know what it must: what the text names has not come, or has "
        "stopped. See the row of what sends it.",
        words=r"^the robot is stopped: ",
    ),
    Advice(
        "What sends this has stopped, died or hangs: see its row; start it again. Best effort messages are "
        "also lost on a network that is too busy.",
        keys=(QUIET,),
        words=r"^nothing on /",
    ),
    Advice(
        "It hangs, is stopped (Ctrl-Z, kill -STOP), waits for a machine that is too busy, or was killed a "
        "moment ago: look at its process (ps; STAT T is stopped, kill -CONT PID lets it go on), its "
        "terminal or log/<node>.log. Before another is started, end this one for good (kill -9 PID): if it "
        "woke up, two would command the robot.",
        keys=(SILENT,),
    ),
    Advice(
        "A signal has stopped its process (Ctrl-Z, kill -STOP). kill -CONT with its number lets it go on, "
        "kill -9 ends it for good: do that before another is started, or two may command the robot.",
        keys=(FROZEN,),
    ),
    Advice(
        "It has left the graph, or was silent so long that it was dropped; its terminal or log/<node>.log "
        "says why. A launcher with --on-death restart starts it again. Else see that its process is gone "
        "(ps), or frozen: kill -9 PID before another is started, or two may command the robot.",
        keys=(GONE,),
    ),
    Advice(
        "It is there and has not said how it is: it is starting (which takes a minute when kernels are "
        "compiled), or hangs; see its terminal or log/<node>.log.",
        keys=(UNHEARD,),
    ),
    Advice(
        "Nobody of this name is in the graph: mend the name, or see that no frozen process of it is there "
        "(ps, STAT T: kill -CONT PID lets it go on), and start it.",
        keys=(ABSENT,),
    ),
    Advice(
        "Two nodes have the same name: end one of them, or rename it (__node:=…).", keys=(TWINS,)
    ),
    Advice(
        "Two nodes send the same thing at once, and who listens gets both: end one of them.",
        keys=(SOURCES,),
    ),
)
