"""The report of one participant: a first page, and folded sections in the order of questions."""

from __future__ import annotations

from bsip_cli.report.blocks import Block, Bullets, Document, Heading, Section, Terms
from bsip_cli.report.first_page import front
from bsip_cli.report.participant import diagnosis, errors, joints, parameters, recording
from bsip_cli.report.records import HowMade, ParticipantRecord, how_made

CANNOT_KNOW = (
    "A mass behind a spherical joint enters the ground force only together with its neighbour's "
    "parameters: each mass is an identified combination plus nearness to the table.",
    "Segments are rigid and joints ideal. Soft tissue, breathing and a bending spine end up in the "
    "parameters or in what is left.",
    "An error that is the same in all recordings can hide in the identified parameters.",
    "Frames are not independent: intervals allow for it.",
)
GLOSSARY = (
    ("COP", "Centre of pressure: where on the plate the ground force acts."),
    ("RM", "Regression method: segment parameters from an anthropometric table."),
    ("RM+mass", "RM, all masses and tensors times one number, so that the plates' weight fits."),
    ("OM", "Optimisation method: parameters identified from this person's movement and forces."),
    ("OM+causes", "OM identified again with every named fault in the model."),
    ("Segment parameters", "Mass, centre of mass and moments of inertia of a body segment."),
    ("Data decide", "Part of the table's uncertainty that the recordings removed; 0: the table."),
    ("Error budget", "What makes the squared difference of simulated and measured forces."),
    ("Held out", "Data that identified nothing, on which methods are compared."),
    ("Probability", "That a fault is there, given all else that was found."),
    ("95 % interval", "Holds the true value in 95 of 100 such recordings."),
    ("sd", "Standard deviation."),
    ("BW", "Body weight."),
)


def participant_document(record: ParticipantRecord) -> Document:
    return Document(
        title=f"{record.id}: do motion and measured forces agree?",
        subtitle="Ground forces computed from the motion, against the plates'.",
        front=front(record),
        sections=(
            diagnosis.section(record),
            errors.section(record),
            joints.section(record),
            parameters.section(record),
            recording.section(record),
            _made(record),
            Section("words", "What do the words mean?", (Terms(GLOSSARY),)),
        ),
    )


def _made(record: ParticipantRecord) -> Section:
    blocks: list[Block] = [
        Heading("What cannot be known"),
        Bullets(CANNOT_KNOW),
        *how_made(HowMade.of(record.origins), record.defaults),
    ]
    return Section("made", "How was it made, and what can it not know?", tuple(blocks))
